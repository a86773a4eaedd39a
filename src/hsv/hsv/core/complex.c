/* Derivatives by the complex step; they are exact to rounding because the square of the step is negligible. */
#define COMPLEX
#include "vehicle.h"

#define STEP 1e-40

void hsv_complex_derivative(const double *x, const double *u, const hsv_vehicle *p, double *out)
{
    real z[STATES], v[INPUTS], rates[STATES];
    memcpy(z, x, sizeof z);
    memcpy(v, u, sizeof v);
    derivative(z, v, (const Vehicle *)p, NULL, rates);
    memcpy(out, rates, sizeof rates);
}

/* Write A = df/dx (9, 9) and B = df/du (9, 2) (paper eq. 6 to eq. 9). */
void hsv_jacobian(const double *x, const double *u, const hsv_vehicle *p, double *A, double *B)
{
    real z[STATES + INPUTS], rates[STATES];
    for (int i = 0; i < STATES + INPUTS; i++) z[i] = i < STATES ? x[i] : u[i - STATES];
    for (int j = 0; j < STATES + INPUTS; j++) {
        __imag__ z[j] = STEP;
        derivative(z, z + STATES, (const Vehicle *)p, NULL, rates);
        for (int i = 0; i < STATES; i++)
            *(j < STATES ? A + STATES * i + j : B + INPUTS * i + j - STATES) = __imag__ rates[i] / STEP;
        __imag__ z[j] = 0.0;
    }
}

/* Write the states (count, 9) one period (count; s) after x (count, 9) with the inputs u (count, 2) held, and their
 * derivatives (count, 9, 12) by state, input and period, multiplied by STEP; the caller divides by STEP. */
void hsv_transitions(int64_t count, const double *x, const double *u, const double *period, const int64_t *substeps,
                     const hsv_vehicle *p, double *end, double *changes)
{
    enum { VARIABLES = STATES + INPUTS + 1 };
    for (int64_t k = 0; k < count; k++)
        for (int j = 0; j < VARIABLES; j++) {
            real z[VARIABLES];
            for (int i = 0; i < VARIABLES; i++)
                z[i] = i < STATES ? x[STATES * k + i] : i < STATES + INPUTS ? u[INPUTS * k + i - STATES] : period[k];
            __imag__ z[j] = STEP;
            advance(z, z + STATES, (const Vehicle *)p, NULL, z[VARIABLES - 1], substeps[k]);
            for (int i = 0; i < STATES; i++) {
                changes[VARIABLES * (STATES * k + i) + j] = __imag__ z[i];
                end[STATES * k + i] = __real__ z[i];
            }
        }
}
