/* Evaluation of flights for campaigns and certificates: level in the invariant set, and curves for the metrics. */
#pragma once
#include "nominal.h"
#include "notch_filter.h"
#include "vehicle.h"

typedef struct {
    real actual[2 * MAX_SECTIONS], planned[2 * MAX_SECTIONS]; /* states of the notch filter for x and for x_r + x_n */
    real worst;                                               /* largest level so far; NaN persists */
} LevelMemory;

/* Return the level (e - c)' P (e - c) of step k, with e = (x - x_r - x_n, s - s_n) in the rigid states and the states
 * of the notch filter, and update the largest level by it. */
static inline real level_step(const hsv_tube_set *set, LevelMemory *memory, int64_t k, const real *x, const real *x_r,
                              const real *x_n)
{
    const int64_t states = 2 * set->notch.sections, rigid = set->size - states;
    real error[RIGID + 2 * MAX_SECTIONS];
    if (k == 0) {
        notch_rest(&set->notch, x[PITCH_RATE], memory->actual);
        memcpy(memory->planned, memory->actual, sizeof memory->planned);
        memory->worst = all(-INFINITY);
    }
    for (int64_t i = 0; i < rigid; i++) error[i] = x[i] - x_r[i] - x_n[i] - set->centre[i];
    for (int64_t i = 0; i < states; i++)
        error[rigid + i] = memory->actual[i] - memory->planned[i] - set->centre[rigid + i];
    const real value = level(set->shape, set->size, error);
    const mask kept = (value <= memory->worst) | (memory->worst != memory->worst);
    memory->worst = choose(kept, memory->worst, value);
    notch_step(&set->notch, memory->actual, x[PITCH_RATE]);
    notch_step(&set->notch, memory->planned, x_r[PITCH_RATE] + x_n[PITCH_RATE]);
    return value;
}

#ifdef BASE
/* Write the levels (steps) of x, x_n and x_r (steps, 9), and return the largest one. */
double hsv_levels(const hsv_tube_set *set, int64_t steps, const double *state, const double *deviation,
                  const double *reference, double *levels)
{
    LevelMemory memory;
    for (int64_t k = 0; k < steps; k++)
        levels[k] = level_step(set, &memory, k, state + STATES * k, reference + STATES * k, deviation + STATES * k);
    return memory.worst;
}

/* Write ten curves (10, stride) and whether each input is saturated (steps, 2), for the steps of a flight. The curves
 * are: errors of altitude and velocity, angle of attack, pitch angle, rates of the two elastic modes, the two inputs,
 * and the absolute differences of angle of attack and pitch angle from x_r + x_n. */
void hsv_curves(int64_t steps, int64_t stride, const double *history, const double *auxiliary, const double *reference,
                double *curves, uint8_t *saturated)
{
    for (int64_t k = 0; k < steps; k++) {
        const double *x = history + HISTORY * k, *x_n = x + STATES + 1, *u = x_n + STATES + INPUTS;
        const double *x_r = reference + STATES * k, *unsaturated = auxiliary + AUXILIARY * k + 1;
        const double alpha = x[ALPHA] - x_r[ALPHA] - x_n[ALPHA], pitch = x[PITCH] - x_r[PITCH] - x_n[PITCH];
        const double h = x[ALTITUDE] - x_r[ALTITUDE], V = x[VELOCITY] - x_r[VELOCITY];
        const double row[10] = {h,       V,           x[ALPHA],         x[PITCH],        x[ETA_1_RATE], x[ETA_2_RATE],
                                u[FUEL], u[ELEVATOR], magnitude(alpha), magnitude(pitch)};
        for (int i = 0; i < 10; i++) curves[stride * i + k] = row[i];
        for (int i = 0; i < INPUTS; i++) saturated[INPUTS * k + i] = u[i] != unsaturated[i];
    }
}
#endif
