/* Derivatives by the complex step; they are exact to rounding because the square of the step is negligible. */
#define COMPLEX
#include "vehicle.h"

#define STEP 1e-40

/* Compilers call these two functions for a / b and a b. Libraries round the quotient differently (libgcc, LLVM's
 * compiler-rt), and the last bits of the trims depend on it; ours are used instead. The order of operations is that of
 * libgcc for |Im b| much smaller than |Re b|, as always in the complex step. */
#define OURS __attribute__((visibility("hidden")))
OURS double _Complex __divdc3(double a_r, double a_i, double b_r, double b_i);
OURS double _Complex __muldc3(double a_r, double a_i, double b_r, double b_i);

double _Complex __divdc3(double a_r, double a_i, double b_r, double b_i)
{
    const double ratio = b_i / b_r, denominator = b_i * ratio + b_r;
    double _Complex quotient;
    __real__ quotient = (a_i * ratio + a_r) / denominator;
    __imag__ quotient = (a_i - a_r * ratio) / denominator;
    return quotient;
}

/* Called where both parts of a product are NaN; the C standard would then recover infinities. */
double _Complex __muldc3(double a_r, double a_i, double b_r, double b_i)
{
    double _Complex product;
    __real__ product = a_r * b_r - a_i * b_i;
    __imag__ product = a_r * b_i + a_i * b_r;
    return product;
}

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
