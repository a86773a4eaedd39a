/* Tube-MPC law (paper eq. 21, eq. 36, eq. 48, eq. 54):
 *
 *   u = F diag(tau) (x - x_r - x_n) + u_n + u_r,   limited to U (eq. 29)
 *
 * with a factor tau for each rigid state. The pitch rate in x is the filtered rate q_f; if the design requires it, the
 * pitch rate of x_r + x_n is filtered as well (eq. 48). Two extensions of the paper's law are off by default: integral
 * action on the errors e of altitude and velocity, k F diag(tau) integral of e, and division of the elevator command by
 * the estimated effectiveness of the elevator (effectiveness.h).
 *
 * Robust MPC, the comparison in the paper (section 5.2), has a nominal gain K in place of F and no x_n and u_n
 * ("planned" is 0). */
#pragma once
#include "notch_filter.h"

typedef struct {
    real planned[2 * MAX_SECTIONS]; /* state s_n of the notch filter of the plan */
    real integral[INTEGRATED];
} TubeMemory;

/* Return the index of the gain in step k. */
static inline int64_t active_gain(const hsv_tube *tube, int64_t k)
{
    int64_t index = 0;
    while (index + 1 < tube->count && tube->starts[index + 1] <= k) index++;
    return index;
}

/* Write the feedback (2), the unsaturated input (2) and the limited input u (2). "gain" (2, 9) is F diag(tau) in this
 * step, "effectiveness" that of the elevator, 1 if it is not estimated; s is the state of the notch filter in the loop.
 *
 * The notch filter of the plan, whose input is the pitch rate of x_r + x_n, starts from s, which is exact for
 * x = x_r + x_n. It is stepped if the loop has a notch filter and the law or the monitor needs it. The integral is kept
 * while an input is saturated. If an input is not finite, the input of the reference replaces it, so that the actuators
 * always receive a number. */
static inline void tube_step(const hsv_tube *tube, TubeMemory *memory, const real *gain, real effectiveness, int64_t k,
                             int monitored, int64_t filter_states, const real *x, real q_f, const real *x_r,
                             const real *u_r, const real *x_n, const real *u_n, const real *s, real *u_feedback,
                             real *u_unsaturated, real *u)
{
    const int64_t own_states = 2 * tube->notch.sections;
    if (k == 0) {
        for (int64_t i = 0; i < own_states && i < filter_states; i++) memory->planned[i] = s[i];
        for (int j = 0; j < INTEGRATED; j++) memory->integral[j] = all(0.0);
    }
    real rate_error = tube->planned ? q_f - x_n[PITCH_RATE] - x_r[PITCH_RATE] : q_f - x_r[PITCH_RATE];
    if ((tube->filtered || monitored) && own_states > 0 && own_states == filter_states) {
        const real planned_rate = notch_step(&tube->notch, memory->planned, x_r[PITCH_RATE] + x_n[PITCH_RATE]);
        if (tube->filtered) rate_error = q_f - planned_rate;
    }
    mask limit = never();
    for (int i = 0; i < INPUTS; i++) {
        const real *row = gain + STATES * i;
        real feedback = all(0.0), integral = all(0.0), plan = tube->planned ? u_n[i] : all(0.0);
        for (int j = 0; j < STATES; j++) {
            const real error = tube->planned ? x[j] - x_n[j] - x_r[j] : x[j] - x_r[j];
            feedback += row[j] * (j == PITCH_RATE ? rate_error : error);
        }
        if (tube->integral_rate > 0.0) {
            for (int j = 0; j < INTEGRATED; j++) integral += tube->integral_rate * row[j] * memory->integral[j];
            plan += integral;
        }
        const real arriving = feedback + plan + u_r[i];
        u_unsaturated[i] = i == ELEVATOR ? arriving / effectiveness : arriving;
        u_feedback[i] = feedback + integral;
        const real flown = choose(is_finite(u_unsaturated[i]), u_unsaturated[i], u_r[i]);
        u[i] = limited(flown, tube->minimum[i], tube->maximum[i]);
        limit |= u[i] != u_unsaturated[i];
    }
    if (tube->integral_rate > 0.0)
        for (int j = 0; j < INTEGRATED; j++) {
            const real more = memory->integral[j] + tube->period * (x[j] - x_r[j] - x_n[j]);
            memory->integral[j] = choose(limit, memory->integral[j], more);
        }
}
