/* The vehicle of a scenario, a block of hsv_block.h in C: written by "hsv export-vehicle", with the numbers of the
 * scenario in scenario.h.
 *
 * It is everything between the command and the measurement: the link and the faults of the command, actuators, vehicle,
 * air, engine, sensors and the link of the measurement. It also has the reference of the scenario with its defect. Step
 * k applies the command over the period from k - 1 to k and outputs the signals at k; step 0 outputs those at 0. */
#define BASE
#include "scenario.h"
#include "hsv_block.h"
#include "plant.h"

#define SIZE(array) (sizeof(array) / sizeof((array)[0]))

/* The state that is kept from step to step; it contains no pointers. */
typedef struct {
    double x[STATES], actuator[INPUTS], actuators[2 * INPUTS], command[INPUTS], effector[INPUTS];
    double conditions[CONDITIONS], atmosphere[SIZE(memory_data_atmosphere)], link[SIZE(memory_data_link)];
    double command_link[SIZE(command_link_memory)];
    hsv_sensor_memory sensors[STATES];
    hsv_fault_memory command_faults[SIZE(command_faults_memory)], effector_faults[SIZE(faults_data_effector_memory)];
    hsv_fault_memory engine_faults[SIZE(faults_data_engine_memory)], sensor_faults[SIZE(faults_data_sensor_memory)];
} Memory;

static void begin(Memory *m)
{
    memcpy(m->x, initial_state, sizeof m->x);
    memset(m->actuator, 0, sizeof m->actuator);
    memcpy(m->actuators, memory_data_actuators, sizeof m->actuators);
    memcpy(m->command, memory_data_command, sizeof m->command);
    memcpy(m->effector, memory_data_effector, sizeof m->effector);
    memcpy(m->conditions, memory_data_conditions, sizeof m->conditions);
    memcpy(m->atmosphere, memory_data_atmosphere, sizeof m->atmosphere);
    memcpy(m->link, memory_data_link, sizeof m->link);
    memcpy(m->command_link, command_link_memory, sizeof m->command_link);
    memcpy(m->sensors, memory_data_sensors, sizeof m->sensors);
    memcpy(m->command_faults, command_faults_memory, sizeof m->command_faults);
    memcpy(m->effector_faults, faults_data_effector_memory, sizeof m->effector_faults);
    memcpy(m->engine_faults, faults_data_engine_memory, sizeof m->engine_faults);
    memcpy(m->sensor_faults, faults_data_sensor_memory, sizeof m->sensor_faults);
}

static int32_t step_vehicle(int64_t k, const double *in, double *out, double *state, const double *par)
{
    Memory m;
    (void)par;
    memcpy(&m, state, sizeof m);
    if (k == 0) begin(&m);
    hsv_plant_memory memory = {.actuators = m.actuators,
                               .command = m.command,
                               .effector = m.effector,
                               .atmosphere = m.atmosphere,
                               .sensors = m.sensors,
                               .link = m.link,
                               .conditions = m.conditions,
                               .air = memory_data.air,
                               .payloads = memory_data.payloads};
    hsv_plant_faults faults = faults_data;
    hsv_faults on_command = command_faults;
    faults.effector.memory = m.effector_faults;
    faults.engine.memory = m.engine_faults;
    faults.sensor.memory = m.sensor_faults;
    on_command.memory = m.command_faults;
    if (k > 0) {
        hsv_flight flight = {.plant = &plant_data, .plant_memory = &memory, .plant_faults = &faults};
        hsv_flight *const flights[] = {&flight};
        memcpy(m.actuator, in, sizeof m.actuator);
        hsv_receive(&command_link_data, m.command_link, COMMAND_LINK_PAYLOADS, k - 1, plant_data.seed, m.actuator,
                    INPUTS);
        hsv_apply_command_faults(&on_command, k - 1, plant_data.seed, m.actuator);
        advance_plants(flights, (const Vehicle *)&plant_data.vehicle, k - 1, m.actuator, m.x);
    }

    double *x = out, *measurement = x + STATES, *status = measurement + STATES, *felt = status + 1;
    double *effector = felt + 5, *air = effector + INPUTS, *actuator = air + 3, *x_r = actuator + INPUTS;
    double *d_r = x_r + STATES, *u_r = d_r + STATES, alpha = m.x[ALPHA];
    memcpy(x, m.x, sizeof m.x);
    hsv_sense(&plant_data, &memory, &faults, k, m.x, measurement);
    *status = !in_model_range(m.x, plant_data.vehicle.angle_limit) ? 2.0 : k >= FINAL_STEP ? 1.0 : 0.0;
    const Vehicle *vehicle = (const Vehicle *)&plant_data.vehicle;
    const Forces f = is_calm(&plant_data, &faults)
                         ? forces(m.x[ALTITUDE], m.x[VELOCITY], alpha, m.x[PITCH_RATE], m.effector, vehicle)
                         : forces_in(m.conditions, m.x, m.effector, vehicle, &alpha);
    felt[0] = f.lift, felt[1] = f.drag, felt[2] = f.thrust, felt[3] = f.moment, felt[4] = f.pressure;
    memcpy(effector, m.effector, sizeof m.effector);
    memcpy(air, m.conditions, 3 * sizeof *air);
    memcpy(actuator, m.actuator, sizeof m.actuator);
    int64_t row = k - reference_data.first;
    row = row < 0 ? 0 : row < reference_data.rows ? row : reference_data.rows - 1;
    memcpy(x_r, reference_data.state + STATES * row, STATES * sizeof *x_r);
    memcpy(d_r, reference_data.defect + STATES * row, STATES * sizeof *d_r);
    memcpy(u_r, reference_data.input + INPUTS * row, INPUTS * sizeof *u_r);
    memcpy(state, &m, sizeof m);
    return 0;
}

static const hsv_signal vehicle_inputs[] = {{"command", HSV_INPUT_UNITS, INPUTS}};
static const hsv_signal vehicle_outputs[] = {
    {"state", HSV_STATE_UNITS, STATES},
    {"measurement", HSV_STATE_UNITS, STATES},
    {"status", "1", 1}, /* 0 in flight, 1 at its end, 2 outside the range of the model */
    {"forces", "N, N, N, N m, Pa", 5},
    {"effector", HSV_INPUT_UNITS, INPUTS},
    {"air", "m/s, m/s, 1", 3},
    {"actuator", HSV_INPUT_UNITS, INPUTS}, /* the command after link and faults */
    {"reference", HSV_STATE_UNITS, STATES},
    {"defect", HSV_STATE_UNITS, STATES},
    {"reference_input", HSV_INPUT_UNITS, INPUTS},
};

const hsv_block vehicle = {
    .abi_version = HSV_BLOCK_ABI_VERSION,
    .name = "vehicle",
    .source = "scenario.h",
    .step = step_vehicle,
    .state_size = sizeof(Memory) / sizeof(double),
    .input_count = HSV_COUNT(vehicle_inputs),
    .inputs = vehicle_inputs,
    .output_count = HSV_COUNT(vehicle_outputs),
    .outputs = vehicle_outputs,
};
