/* Controllers as bare step functions of hsv_block.h, for tests that fly their addresses. */
#include "hsv_block.h"

/* Counts its steps in its state, or in its first parameter if the second one is not zero: all copies share that, like a
 * static variable of a library. */
int32_t counting(int64_t k, const double *in, double *out, double *state, const double *par)
{
    double *kept = par[1] != 0.0 ? (double *)par : state;
    (void)k;
    kept[0] += 1.0;
    out[0] = in[HSV_REFERENCE_INPUT];
    out[1] = in[HSV_REFERENCE_INPUT + 1] + 1e-9 * kept[0];
    return 0;
}

/* The regulator of examples/lqr; parameters: period (s), lower and upper limits of the input (2 each), gain (2 x 7) row
 * by row; state: the integrals of the altitude and velocity errors, which stand still while an input is limited. */
int32_t lqr(int64_t k, const double *in, double *out, double *state, const double *par)
{
    const double *minimum = par + 1, *maximum = par + 3, *gain = par + 5;
    double error[7];
    int limited = 0;
    (void)k;
    for (int j = 0; j < 5; j++)
        error[j] = in[j == HSV_PITCH_RATE ? HSV_FILTERED_PITCH_RATE : HSV_ESTIMATE + j] - in[HSV_REFERENCE + j];
    error[5] = state[0];
    error[6] = state[1];
    for (int i = 0; i < 2; i++) {
        double total = 0.0;
        for (int j = 0; j < 7; j++) total += gain[7 * i + j] * error[j];
        out[i] = in[HSV_REFERENCE_INPUT + i] - total;
        limited |= out[i] < minimum[i] || out[i] > maximum[i];
    }
    for (int i = 0; i < 2 && !limited; i++) state[i] += par[0] * error[i];
    return 0;
}
