/* State estimator for noisy sensors: an extended Kalman filter with constant gain.
 *
 *   x^-(k) = phi_T(x^(k-1), u(k-1) + b(k-1)),   [x^(k); b(k)] = [x^-(k); b(k-1)] + L (y(k) - x^-(k)),
 *
 * with phi_T the motion of the nominal vehicle over a period, b an offset of each input that compensates model errors,
 * and L the steady-state gain at the initial trim of the flight (hsv.control.estimator). Only the five rigid states are
 * measured (y, and x^- in the difference); L corrects the elastic states through them. */
#pragma once
#include "vehicle.h"

enum { ESTIMATED = STATES + INPUTS };

/* Write the estimate x^ (9); "memory" (11) is [x^; b] of the previous step. Step 0 initialises it. */
static inline void estimate_step(const hsv_estimator *estimator, const Vehicle *vehicle, real *memory, int64_t k,
                                 const real *measurement, const real *command, real *estimate)
{
    if (k == 0) {
        for (int i = 0; i < STATES; i++) estimate[i] = all(estimator->start[i]);
        for (int i = 0; i < INPUTS; i++) memory[STATES + i] = all(0.0);
    } else {
        real held[INPUTS];
        for (int i = 0; i < STATES; i++) estimate[i] = memory[i];
        for (int i = 0; i < INPUTS; i++) held[i] = command[i] + memory[STATES + i];
        advance(estimate, held, vehicle, NULL, all(estimator->period), estimator->substeps);
    }
    for (int i = 0; i < STATES; i++) memory[i] = estimate[i];
    for (int i = 0; i < ESTIMATED; i++)
        for (int j = 0; j < RIGID; j++) memory[i] += estimator->gain[i][j] * (measurement[j] - estimate[j]);
    for (int i = 0; i < STATES; i++) estimate[i] = memory[i];
}
