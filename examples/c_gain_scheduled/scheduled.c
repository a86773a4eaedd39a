/* State feedback with two gains, interpolated over the velocity: u = u_r - K(V) (x - x_r). No design is used.
 *
 * The law is that of examples/compiled, which computes the gains of linear-quadratic regulators at two velocities. Here
 * the gains are constants, which a scenario may replace.
 */
#include "hsv_block.h"

enum { RIGID = HSV_PITCH_RATE + 1 };

/* Indices of the parameters, in the order of the table below. */
enum { LOW_VELOCITY, HIGH_VELOCITY, LOW_GAIN, HIGH_GAIN = LOW_GAIN + HSV_INPUTS * RIGID };

static const double low_velocity = 2407.92, high_velocity = 2484.12;
static const double low_gain[HSV_INPUTS * RIGID] = {
    3.3645409371192004e-03,  1.8179266648129907e-02,  -5.4504184301896935e+01, 8.3205063540665705e+01,
    8.7767737870284144e+00,  -5.4158574194675449e-04, 3.1332340542011834e-03,  5.1511211746532188e+00,
    -1.9396949111596911e+01, -4.4265438804606978e+00};
static const double high_gain[HSV_INPUTS * RIGID] = {
    3.2242635712717315e-03,  1.8865183009979369e-02,  -5.2712965506681414e+01, 7.9581038996902450e+01,
    8.0371381994993172e+00,  -5.7505449249087097e-04, 2.9931519279369997e-03,  5.8122180901568301e+00,
    -2.0167376964694938e+01, -4.3655679273261798e+00};

static const hsv_parameter parameters[] = {
    {.name = "low_velocity",
     .unit = "m/s",
     .description = "velocity of the first gain",
     .size = 1,
     .value = &low_velocity,
     .minimum = 2346.96,
     .maximum = 2529.84},
    {.name = "high_velocity",
     .unit = "m/s",
     .description = "velocity of the second gain",
     .size = 1,
     .value = &high_velocity,
     .minimum = 2346.96,
     .maximum = 2529.84},
    {.name = "low_gain",
     .unit = "1",
     .description = "first gain, 2 x 5, row by row, SI",
     .size = HSV_COUNT(low_gain),
     .value = low_gain},
    {.name = "high_gain",
     .unit = "1",
     .description = "second gain, 2 x 5, row by row, SI",
     .size = HSV_COUNT(high_gain),
     .value = high_gain},
};

static const hsv_signal inputs[] = {HSV_CONTROLLER_INPUTS}, outputs[] = {HSV_CONTROLLER_OUTPUTS};

static int32_t step(int64_t k, const double *in, double *out, double *state, const double *par)
{
    (void)k, (void)state;
    if (!(par[LOW_VELOCITY] < par[HIGH_VELOCITY])) return 1;
    double share = (in[HSV_ESTIMATE + HSV_VELOCITY] - par[LOW_VELOCITY]) / (par[HIGH_VELOCITY] - par[LOW_VELOCITY]);
    share = share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;
    for (int i = 0; i < HSV_INPUTS; i++) {
        double total = 0.0;
        for (int j = 0; j < RIGID; j++) {
            const double value = in[j == HSV_PITCH_RATE ? HSV_FILTERED_PITCH_RATE : HSV_ESTIMATE + j];
            const double low = par[LOW_GAIN + RIGID * i + j], high = par[HIGH_GAIN + RIGID * i + j];
            total += (low + share * (high - low)) * (value - in[HSV_REFERENCE + j]);
        }
        out[i] = in[HSV_REFERENCE_INPUT + i] - total;
    }
    return 0;
}

const hsv_block scheduled = {
    .abi_version = HSV_BLOCK_ABI_VERSION,
    .name = "scheduled",
    .source = "scheduled.c",
    .step = step,
    .input_count = HSV_COUNT(inputs),
    .inputs = inputs,
    .output_count = HSV_COUNT(outputs),
    .outputs = outputs,
    .parameter_count = HSV_COUNT(parameters),
    .parameters = parameters,
};
