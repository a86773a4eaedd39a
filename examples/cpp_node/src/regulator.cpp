// A controller as a separate ROS 2 node in C++, which uses nothing of the bench except its messages.
#include <algorithm>
#include <memory>

#include <hsv_msgs/msg/control_input.hpp>
#include <hsv_msgs/msg/filtered_state.hpp>
#include <hsv_msgs/msg/nominal_state.hpp>
#include <rclcpp/rclcpp.hpp>

using hsv_msgs::msg::ControlInput;
using hsv_msgs::msg::FilteredState;
using hsv_msgs::msg::NominalState;

// A linear-quadratic regulator about 85 500 ft and 7900 ft/s: fuel (-), elevator (rad).
constexpr double GAIN[2][5] = {{-5.05e-3, -2.26e-2, 69.9, -99.0, -8.85}, {9.26e-4, -4.46e-3, -10.4, 24.8, 4.50}};
constexpr double MINIMUM[2] = {0.0, -0.5235987755982988}, MAXIMUM[2] = {1.5, 0.5235987755982988};

// Publishes the command of a step when both the filtered and the nominal state of the step have arrived.
class Regulator : public rclcpp::Node
{
  public:
    Regulator() : Node("regulator")
    {
        const rclcpp::QoS deep(256);
        command_ = create_publisher<ControlInput>("hsv/command", deep);
        filtered_subscription_ = create_subscription<FilteredState>(
            "hsv/filtered_state", deep,
            [this](FilteredState::ConstSharedPtr message) { filtered_ = message, answer(); });
        nominal_subscription_ = create_subscription<NominalState>(
            "hsv/nominal", deep, [this](NominalState::ConstSharedPtr message) { nominal_ = message, answer(); });
    }

  private:
    void answer() // either message may come first
    {
        if (!filtered_ || !nominal_ || filtered_->step != nominal_->step) return;
        const auto &x = filtered_->state, &x_r = nominal_->reference;
        const auto &u_r = nominal_->reference_input;
        const double error[5] = {x.altitude - x_r.altitude, x.velocity - x_r.velocity,
                                 x.angle_of_attack - x_r.angle_of_attack, x.pitch_angle - x_r.pitch_angle,
                                 filtered_->filtered_pitch_rate - x_r.pitch_rate};
        double u[2] = {u_r.fuel_equivalence_ratio, u_r.elevator_deflection};
        ControlInput command;
        command.header = filtered_->header;
        command.step = filtered_->step;
        for (int i = 0; i < 2; i++) {
            for (int j = 0; j < 5; j++) u[i] += GAIN[i][j] * error[j];
            const double limited = std::clamp(u[i], MINIMUM[i], MAXIMUM[i]);
            command.saturated[i] = limited != u[i];
            u[i] = limited;
        }
        command.fuel_equivalence_ratio = u[0];
        command.elevator_deflection = u[1];
        command_->publish(command);
    }

    rclcpp::Publisher<ControlInput>::SharedPtr command_;
    rclcpp::Subscription<FilteredState>::SharedPtr filtered_subscription_;
    rclcpp::Subscription<NominalState>::SharedPtr nominal_subscription_;
    FilteredState::ConstSharedPtr filtered_;
    NominalState::ConstSharedPtr nominal_;
};

int main(int argc, char **argv)
{
    rclcpp::init(argc, argv);
    rclcpp::spin(std::make_shared<Regulator>());
    rclcpp::shutdown();
}
