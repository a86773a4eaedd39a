/* Notch filter of the pitch rate (paper eq. 38, eq. 39; q' is q_f and x_q is s here): second-order sections in series,
 *
 *   q_f(k) = C s(k) + D q(k),   s(k+1) = A s(k) + B q(k),
 *
 * discretised by the bilinear rule with prewarping (hsv.control.notch_filter). The filter starts in the equilibrium for
 * its first input: s(0) = G q(0). */
#pragma once
#include "real.h"

/* Write the states s in equilibrium for a constant rate (rad/s). */
static inline void notch_rest(const hsv_notch *notch, real rate, real *s)
{
    for (int i = 0; i < notch->sections; i++) {
        s[2 * i] = notch->G[2 * i] * rate;
        s[2 * i + 1] = notch->G[2 * i + 1] * rate;
    }
}

/* Return the filtered rate (rad/s) and update s. */
static inline real notch_step(const hsv_notch *notch, real *s, real rate)
{
    for (int i = 0; i < notch->sections; i++) {
        const double *A = notch->A + 4 * i, *B = notch->B + 2 * i, *C = notch->C + 2 * i;
        const real a = s[2 * i], b = s[2 * i + 1];
        const real filtered = C[0] * a + C[1] * b + notch->D[i] * rate;
        s[2 * i] = A[0] * a + A[1] * b + B[0] * rate;
        s[2 * i + 1] = A[2] * a + A[3] * b + B[1] * rate;
        rate = filtered;
    }
    return rate;
}
