/* Notch filter, nominal trajectory and tube law of a design as blocks of hsv_block.h in C99, written by
 * "hsv export-controller". design.h contains the numbers of the design.
 *
 * The blocks are stepped once per period T, k = 0, 1, 2, ..., in this order:
 *
 *   notch_filter        pitch rate -> q_f and s (eq. 38, eq. 39)
 *   nominal_trajectory  x, x_r, d_r -> x_n and u_n (eq. 11, eq. 20, eq. 32 to eq. 35)
 *   tube_law            x, q_f, x_r, u_r, x_n, u_n, and s if the plan is filtered -> u (eq. 36, eq. 48, eq. 54)
 *
 * The block "controller" steps all three: x, x_r, d_r, u_r -> u before and after the limits, and the outputs of the
 * first two blocks.
 *
 * The equations are those of X. Yang, W. Lv, H. Mi, C. Hu, Y. Hu, "Tube-MPC Control via Notch Filter for Flexible
 * Air-Breathing Hypersonic Vehicle with Actuator Fault", 2022. The headers, the same as in the bench, contain them. x
 * is the measured state; x_r and u_r are the reference of the step. d_r is its defect: the state to which x_r(k) and
 * u_r(k) lead in a period, minus x_r(k + 1). It is zero while the reference is constant. The caller of tube_law limits
 * u to U (eq. 29), tube_data.minimum to tube_data.maximum. Of core.h and real.h only the types hsv_notch, hsv_polytope,
 * hsv_nominal and hsv_tube and the number type double are used here.
 *
 *   cc -std=c99 -O3 -ffp-contract=off -shared -fPIC -o controller.so controller.c
 *
 * No library function is called and no memory is allocated; a step needs less than 4 KiB of stack. Every compiler gives
 * the same bits as long as it does not contract a product and a sum into one operation.
 */
#include "design.h"
#include "hsv_block.h"
#include "nominal.h"
#include "tube_law.h"

enum { FILTER_STATES = 2 * SECTIONS, PLANNED_STATES = FILTERED ? FILTER_STATES : 0 };

/* Notch filter */

static int32_t step_notch_filter(int64_t k, const double *in, double *out, double *state, const double *par)
{
    (void)par;
    if (k == 0) notch_rest(&tube_data.notch, in[0], state);
    for (int i = 0; i < FILTER_STATES; i++) out[1 + i] = state[i]; /* s before the update */
    out[0] = notch_step(&tube_data.notch, state, in[0]);
    return 0;
}

static const hsv_signal notch_inputs[] = {{"pitch_rate", "rad/s", 1}};
static const hsv_signal notch_outputs[] = {{"filtered_pitch_rate", "rad/s", 1}, HSV_FILTER_STATE_INPUT(FILTER_STATES)};

const hsv_block notch_filter = {
    .abi_version = HSV_BLOCK_ABI_VERSION,
    .name = "notch_filter",
    .source = "design.h",
    .step = step_notch_filter,
    .state_size = FILTER_STATES,
    .input_count = HSV_COUNT(notch_inputs),
    .inputs = notch_inputs,
    .output_count = HSV_COUNT(notch_outputs),
    .outputs = notch_outputs,
};

/* Nominal trajectory */

enum { OUTSIDE_FAMILY = 1, OUTSIDE_ENVELOPE = 2 };

static int32_t step_nominal_trajectory(int64_t k, const double *in, double *out, double *state, const double *par)
{
    const double *x = in, *x_r = x + HSV_STATES, *d_r = x_r + HSV_STATES;
    double *x_n = out, *u_n = x_n + HSV_STATES, *gain_index = u_n + HSV_INPUTS, *status = gain_index + 1;
    (void)par;
    for (int i = 0; i < HSV_STATES; i++) {
        if (k == 0) state[i] = x[i] - x_r[i];
        x_n[i] = state[i];
    }
    const int in_family = nominal_input(&nominal_data, x_n, u_n, gain_index);
    const int in_envelope = nominal_advance(&nominal_data.polytope, x[HSV_ALTITUDE], x[HSV_VELOCITY], state, u_n, d_r);
    *status = (in_family ? 0 : OUTSIDE_FAMILY) + (in_envelope ? 0 : OUTSIDE_ENVELOPE);
    return 0;
}

static const hsv_signal nominal_inputs[] = {
    {"measurement", HSV_STATE_UNITS, HSV_STATES},
    {"reference", HSV_STATE_UNITS, HSV_STATES},
    {"defect", HSV_STATE_UNITS, HSV_STATES},
};
static const hsv_signal nominal_outputs[] = {
    {"deviation", HSV_STATE_UNITS, HSV_STATES},
    {"nominal_input", HSV_INPUT_UNITS, HSV_INPUTS},
    {"gain_index", "1", 1},      /* index of the gain in the nested family, 0 for the outermost */
    {"nominal_status", "1", 1}}; /* sum of OUTSIDE_FAMILY (of x_n) and OUTSIDE_ENVELOPE (of altitude and velocity) */

const hsv_block nominal_trajectory = {
    .abi_version = HSV_BLOCK_ABI_VERSION,
    .name = "nominal_trajectory",
    .source = "design.h",
    .step = step_nominal_trajectory,
    .state_size = HSV_STATES,
    .input_count = HSV_COUNT(nominal_inputs),
    .inputs = nominal_inputs,
    .output_count = HSV_COUNT(nominal_outputs),
    .outputs = nominal_outputs,
};

/* Tube law; its state consists of the integrals, then the states of the plan's notch filter */

static int32_t step_tube_law(int64_t k, const double *in, double *out, double *state, const double *par)
{
    const double *tau = par, *x = in + HSV_ESTIMATE, *u_r = in + HSV_REFERENCE_INPUT;
    double gain[HSV_INPUTS * HSV_STATES], feedback[HSV_INPUTS], total[HSV_INPUTS], limited_input[HSV_INPUTS];
    hsv_tube law = tube_data;
    TubeMemory memory;
    law.integral_rate = par[RIGID];
    for (int i = 0; i < HSV_INPUTS; i++)
        for (int j = 0; j < HSV_STATES; j++) {
            const double F = law.gains[HSV_STATES * i + j];
            gain[HSV_STATES * i + j] = j < RIGID ? F * tau[j] : F;
        }
    for (int j = 0; j < INTEGRATED; j++) memory.integral[j] = state[j];
    for (int j = 0; j < PLANNED_STATES; j++) memory.planned[j] = state[INTEGRATED + j];
    tube_step(&law, &memory, gain, 1.0, k, 0, PLANNED_STATES, x, in[HSV_FILTERED_PITCH_RATE], in + HSV_REFERENCE, u_r,
              in + HSV_DEVIATION, in + HSV_NOMINAL_INPUT, in + HSV_FILTER_STATE, feedback, total, limited_input);
    for (int j = 0; j < INTEGRATED; j++) state[j] = memory.integral[j];
    for (int j = 0; j < PLANNED_STATES; j++) state[INTEGRATED + j] = memory.planned[j];
    for (int i = 0; i < HSV_INPUTS; i++) out[i] = is_finite(total[i]) ? total[i] : u_r[i];
    return 0;
}

static const hsv_signal tube_inputs[] = {HSV_CONTROLLER_INPUTS, HSV_FILTER_STATE_INPUT(FILTER_STATES)};
static const hsv_signal tube_outputs[] = {HSV_CONTROLLER_OUTPUTS};

static const double no_integral_action = 0.0;
static const hsv_parameter tube_parameters[] = {
    {.name = "tau",
     .unit = "1",
     .description = "factor of each rigid state's feedback (eq. 54)",
     .size = RIGID,
     .value = designed_tau,
     .minimum = TAU_MINIMUM,
     .maximum = 1.0},
    {.name = "integral_rate",
     .unit = "1/s",
     .description = "of the integral action; 0: none",
     .size = 1,
     .value = &no_integral_action,
     .minimum = 0.0,
     .maximum = 1.0},
};

const hsv_block tube_law = {
    .abi_version = HSV_BLOCK_ABI_VERSION,
    .name = "tube_law",
    .source = "design.h",
    .step = step_tube_law,
    .state_size = INTEGRATED + PLANNED_STATES,
    .input_count = HSV_COUNT(tube_inputs) - (FILTERED ? 0 : 1),
    .inputs = tube_inputs,
    .output_count = HSV_COUNT(tube_outputs),
    .outputs = tube_outputs,
    .parameter_count = HSV_COUNT(tube_parameters),
    .parameters = tube_parameters,
};

/* Controller: the three blocks with their states and parameters, and the limits of u */

static int32_t step_controller(int64_t k, const double *in, double *out, double *state, const double *par)
{
    const double *x = in, *x_r = x + HSV_STATES, *u_r = x_r + 2 * HSV_STATES;
    double *wanted = out, *command = wanted + HSV_INPUTS, *filtered = command + HSV_INPUTS;
    double *filter_state = filtered + 1, *plan = filter_state + FILTER_STATES;
    double law[HSV_FILTER_STATE + FILTER_STATES];
    step_notch_filter(k, x + HSV_PITCH_RATE, filtered, state, 0);
    step_nominal_trajectory(k, in, plan, state + FILTER_STATES, 0);
    for (int i = 0; i < HSV_STATES; i++) {
        law[HSV_ESTIMATE + i] = x[i];
        law[HSV_REFERENCE + i] = x_r[i];
    }
    law[HSV_FILTERED_PITCH_RATE] = filtered[0];
    for (int i = 0; i < HSV_INPUTS; i++) law[HSV_REFERENCE_INPUT + i] = u_r[i];
    for (int i = 0; i < HSV_STATES + HSV_INPUTS; i++) law[HSV_DEVIATION + i] = plan[i];
    for (int i = 0; i < FILTER_STATES; i++) law[HSV_FILTER_STATE + i] = filter_state[i];
    step_tube_law(k, law, wanted, state + FILTER_STATES + HSV_STATES, par);
    for (int i = 0; i < HSV_INPUTS; i++) command[i] = limited(wanted[i], tube_data.minimum[i], tube_data.maximum[i]);
    return 0;
}

static const hsv_signal controller_inputs[] = {
    {"measurement", HSV_STATE_UNITS, HSV_STATES},
    {"reference", HSV_STATE_UNITS, HSV_STATES},
    {"defect", HSV_STATE_UNITS, HSV_STATES},
    {"reference_input", HSV_INPUT_UNITS, HSV_INPUTS},
};
static const hsv_signal controller_outputs[] = {
    HSV_CONTROLLER_OUTPUTS,
    {"command", HSV_INPUT_UNITS, HSV_INPUTS},
    {"filtered_pitch_rate", "rad/s", 1},
    HSV_FILTER_STATE_INPUT(FILTER_STATES),
    {"deviation", HSV_STATE_UNITS, HSV_STATES},
    {"nominal_input", HSV_INPUT_UNITS, HSV_INPUTS},
    {"gain_index", "1", 1},
    {"nominal_status", "1", 1},
};

const hsv_block controller = {
    .abi_version = HSV_BLOCK_ABI_VERSION,
    .name = "controller",
    .source = "design.h",
    .step = step_controller,
    .state_size = FILTER_STATES + HSV_STATES + INTEGRATED + PLANNED_STATES,
    .input_count = HSV_COUNT(controller_inputs),
    .inputs = controller_inputs,
    .output_count = HSV_COUNT(controller_outputs),
    .outputs = controller_outputs,
    .parameter_count = HSV_COUNT(tube_parameters),
    .parameters = tube_parameters,
};
