/* The in-process flight of the compiled loop, written in C: the yardstick of "hsv bench".
 *
 * Filter, nominal trajectory and tube law are those of "hsv export-controller"; vehicle, faults and the loop are here, the
 * same arithmetic in the same order as hsv.simulation.closed_loop._fly and what it calls, so that, without contraction, the
 * results can be compared bit by bit. Names are those of the Python sources.
 */
#include "hsv_block.h"

#include <math.h>
#include <string.h>

enum { N = HSV_STATES, M = HSV_INPUTS };

extern const hsv_block notch_filter, nominal_trajectory, tube_law;

/* In the order of hsv.vehicle.parameters.VehicleParameters. */
typedef struct {
    double mass, moment_of_inertia, gravity, reference_area, mean_aerodynamic_chord, thrust_moment_arm;
    double reference_density, reference_altitude, density_scale_height;
    double lift_alpha, lift_elevator, lift_zero;
    double drag_alpha_squared, drag_alpha, drag_elevator_squared, drag_elevator, drag_zero;
    double moment_alpha_squared, moment_alpha, moment_zero, moment_elevator;
    double thrust_beta_1, thrust_beta_2, thrust_beta_3, thrust_beta_4;
    double thrust_beta_5, thrust_beta_6, thrust_beta_7, thrust_beta_8;
    double elastic_force_1_alpha_squared, elastic_force_1_alpha, elastic_force_1_zero;
    double elastic_force_2_alpha_squared, elastic_force_2_alpha, elastic_force_2_elevator, elastic_force_2_zero;
    double damping_ratio_1, damping_ratio_2, natural_frequency_1, natural_frequency_2;
    double inertial_coupling_1, inertial_coupling_2;
} Vehicle;

/* The parameters of tube_law, a row of so many from each step in starts on, and the limits of its input. */
typedef struct {
    int64_t rows, size;
    const int64_t *starts;
    const double *parameters, *minimum, *maximum;
} Tube;

typedef struct {
    int64_t count;
    const int64_t *start, *stop, *channel;
    const double *effectiveness;
} Faults;

typedef struct {
    int64_t first, rows;
    const double *state, *input, *defect;
} Reference;

typedef struct {
    int64_t rows;
    double *flown, *beside; /* 25 and 3 numbers a row */
} History;

static void derivative(const double *x, const double *u, const Vehicle *p, double *out)
{
    const double altitude = x[0], velocity = x[1], alpha = x[2], pitch = x[3], rate = x[4];
    const double fuel = u[0], elevator = u[1];
    const double density = p->reference_density * exp(-(altitude - p->reference_altitude) / p->density_scale_height);
    const double pressure = 0.5 * density * velocity * velocity;
    const double alpha2 = alpha * alpha;
    const double lift =
        pressure * p->reference_area * (p->lift_alpha * alpha + p->lift_elevator * elevator + p->lift_zero);
    const double drag = pressure * p->reference_area *
                        (p->drag_alpha_squared * alpha2 + p->drag_alpha * alpha +
                         p->drag_elevator_squared * elevator * elevator + p->drag_elevator * elevator + p->drag_zero);
    const double thrust = (p->thrust_beta_1 * fuel + p->thrust_beta_2) * alpha2 * alpha +
                          (p->thrust_beta_3 * fuel + p->thrust_beta_4) * alpha2 +
                          (p->thrust_beta_5 * fuel + p->thrust_beta_6) * alpha +
                          (p->thrust_beta_7 * fuel + p->thrust_beta_8);
    const double moment = p->thrust_moment_arm * thrust +
                          pressure * p->reference_area * p->mean_aerodynamic_chord *
                              (p->moment_alpha_squared * alpha2 + p->moment_alpha * alpha + p->moment_zero +
                               p->moment_elevator * elevator);

    const double force_1 =
        p->elastic_force_1_alpha_squared * alpha2 + p->elastic_force_1_alpha * alpha + p->elastic_force_1_zero;
    const double force_2 = p->elastic_force_2_alpha_squared * alpha2 + p->elastic_force_2_alpha * alpha +
                           p->elastic_force_2_elevator * elevator + p->elastic_force_2_zero;
    const double psi_1 = p->inertial_coupling_1, psi_2 = p->inertial_coupling_2;
    const double c_1 = psi_1 / p->moment_of_inertia, c_2 = psi_2 / p->moment_of_inertia;
    const double angular = moment / p->moment_of_inertia;
    const double omega_1 = p->natural_frequency_1, omega_2 = p->natural_frequency_2;
    const double k_1 = 1.0 + psi_1 * c_1;
    const double k_2 = 1.0 + psi_2 * c_2;
    const double k_12 = psi_1 * c_2;
    const double right_1 =
        -2.0 * p->damping_ratio_1 * omega_1 * x[6] - omega_1 * omega_1 * x[5] + force_1 - psi_1 * angular;
    const double right_2 =
        -2.0 * p->damping_ratio_2 * omega_2 * x[8] - omega_2 * omega_2 * x[7] + force_2 - psi_2 * angular;
    const double determinant = k_1 * k_2 - k_12 * k_12;
    const double acceleration_1 = (k_2 * right_1 - k_12 * right_2) / determinant;
    const double acceleration_2 = (k_1 * right_2 - k_12 * right_1) / determinant;

    const double sin_alpha = sin(alpha), cos_alpha = cos(alpha);
    const double sin_path = sin(pitch - alpha), cos_path = cos(pitch - alpha);
    out[0] = velocity * sin_path;
    out[1] = (thrust * cos_alpha - drag) / p->mass - p->gravity * sin_path;
    out[2] = (-thrust * sin_alpha - lift) / (p->mass * velocity) + rate + p->gravity / velocity * cos_path;
    out[3] = rate;
    out[4] = angular + c_1 * acceleration_1 + c_2 * acceleration_2;
    out[5] = x[6];
    out[6] = acceleration_1;
    out[7] = x[8];
    out[8] = acceleration_2;
}

static void advance(double *x, const double *u, const Vehicle *p, double period, int64_t substeps)
{
    const double h = period / (double)substeps;
    double slope[N], point[N], total[N];
    for (int64_t step = 0; step < substeps; step++) {
        derivative(x, u, p, slope);
        for (int i = 0; i < N; i++) {
            total[i] = slope[i];
            point[i] = x[i] + 0.5 * h * slope[i];
        }
        derivative(point, u, p, slope);
        for (int i = 0; i < N; i++) {
            total[i] += 2.0 * slope[i];
            point[i] = x[i] + 0.5 * h * slope[i];
        }
        derivative(point, u, p, slope);
        for (int i = 0; i < N; i++) {
            total[i] += 2.0 * slope[i];
            point[i] = x[i] + h * slope[i];
        }
        derivative(point, u, p, slope);
        for (int i = 0; i < N; i++)
            x[i] += h / 6.0 * (total[i] + slope[i]);
    }
}

static void apply_faults(const Faults *faults, int64_t step, const double *command, double *actuator)
{
    memcpy(actuator, command, M * sizeof *actuator);
    for (int64_t row = 0; row < faults->count; row++)
        if (faults->start[row] <= step && step < faults->stop[row])
            actuator[faults->channel[row]] *= faults->effectiveness[row];
}

static int64_t reference_row(const Reference *reference, int64_t step)
{
    const int64_t row = step > reference->first ? step - reference->first : 0;
    return row < reference->rows ? row : reference->rows - 1;
}

static int in_model_range(const double *x, double angle_limit)
{
    for (int i = 0; i < N; i++)
        if (!isfinite(x[i]))
            return 0;
    return fabs(x[2]) <= angle_limit && fabs(x[3]) <= angle_limit && x[1] > 0.0;
}

static const double *active_parameters(const Tube *tube, int64_t step)
{
    int64_t row = 0;
    while (row + 1 < tube->rows && tube->starts[row + 1] <= step)
        row++;
    return tube->parameters + row * tube->size;
}

/* Fly as many steps as there are rows, from x; return the number of rows written (fewer: diverged). Without the notch
 * filter in the loop the pitch rate passes. */
int64_t fly(const Vehicle *vehicle, double period, int64_t substeps, double angle_limit, int64_t notched,
            const Tube *tube, const Faults *faults, const Reference *reference, double *x, const History *history)
{
    const int64_t filter_size = notch_filter.state_size;
    double filter_state[filter_size], filtered[1 + filter_size];
    double asked[3 * N], nominal_state[N], nominal[N + M + 2];
    double given[HSV_FILTER_STATE + filter_size], tube_state[tube_law.state_size];
    double wanted[M], u[M], actuator[M];
    memset(filter_state, 0, sizeof filter_state);
    memset(filtered, 0, sizeof filtered);
    memset(nominal_state, 0, sizeof nominal_state);
    memset(tube_state, 0, sizeof tube_state);
    for (int64_t k = 0; k < history->rows; k++) {
        if (k > 0)
            advance(x, actuator, vehicle, period, substeps);
        const int64_t row = reference_row(reference, k);
        const double *x_r = reference->state + row * N, *u_r = reference->input + row * M;
        const double *d_r = reference->defect + row * N;

        if (notched)
            notch_filter.step(k, x + HSV_PITCH_RATE, filtered, filter_state, NULL);
        else
            filtered[0] = x[HSV_PITCH_RATE];

        memcpy(asked, x, sizeof(double[N]));
        memcpy(asked + N, x_r, sizeof(double[N]));
        memcpy(asked + 2 * N, d_r, sizeof(double[N]));
        nominal_trajectory.step(k, asked, nominal, nominal_state, NULL);

        memcpy(given + HSV_ESTIMATE, x, sizeof(double[N]));
        memcpy(given + HSV_FILTERED_PITCH_RATE, filtered, sizeof(double));
        memcpy(given + HSV_REFERENCE, x_r, sizeof(double[N]));
        memcpy(given + HSV_REFERENCE_INPUT, u_r, sizeof(double[M]));
        memcpy(given + HSV_DEVIATION, nominal, sizeof(double[N + M]));
        memcpy(given + HSV_FILTER_STATE, filtered + 1, sizeof filter_state);
        tube_law.step(k, given, wanted, tube_state, active_parameters(tube, k));
        for (int i = 0; i < M; i++) {
            const double above = wanted[i] > tube->minimum[i] ? wanted[i] : tube->minimum[i];
            u[i] = above < tube->maximum[i] ? above : tube->maximum[i];
        }
        apply_faults(faults, k, u, actuator);

        double *flown = history->flown + k * (2 * N + 1 + 3 * M), *beside = history->beside + k * (1 + M);
        memcpy(flown, x, sizeof(double[N]));
        flown[N] = filtered[0];
        memcpy(flown + N + 1, nominal, sizeof(double[N]));
        memcpy(flown + 2 * N + 1, nominal + N, sizeof(double[M]));
        memcpy(flown + 2 * N + 1 + M, u, sizeof u);
        memcpy(flown + 2 * N + 1 + 2 * M, actuator, sizeof actuator);
        beside[0] = nominal[N + M];
        memcpy(beside + 1, wanted, sizeof wanted);
        if (!in_model_range(x, angle_limit))
            return k + 1;
    }
    return history->rows;
}
