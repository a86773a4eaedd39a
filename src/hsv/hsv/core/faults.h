/* Occurrence of faults, and the faults of command and engine.
 *
 * A fault acts in the steps [start, stop): always, periodically, or at random as a two-state Markov chain. Rows are in
 * the order of composition. Random numbers are drawn once per control period. Faults of actuators and effectors are in
 * actuators.h, of sensors in sensors.h. */
#pragma once
#include "noise.h"

/* Return x as an integer from low to high, and low for NaN; a mere cast of what does not fit is undefined in C. */
static int64_t whole(double x, int64_t low, int64_t high)
{
    return x > (double)low ? x < (double)high ? (int64_t)x : high : low;
}

/* Determine which faults act in step k, in "acting" of their memory; return their number. */
int64_t hsv_begin_faults(hsv_faults *faults, int64_t k, int64_t seed)
{
    int64_t acting = 0;
    const double step = (double)k;
    for (int64_t i = 0; i < faults->count; i++) {
        const hsv_fault *fault = &faults->rows[i];
        hsv_fault_memory *memory = &faults->memory[i];
        int acts = fault->start <= step && step < fault->stop;
        if (acts && fault->occurrence == PERIODIC)
            acts = (k - whole(fault->start, 0, MOST_STEPS)) % whole(fault->cycle[0], 1, MOST_STEPS) <
                   whole(fault->cycle[1], 0, MOST_STEPS);
        else if (acts && fault->occurrence == RANDOM) {
            if (step == fault->start)
                memory->away = 0;
            else {
                const double drawn = first_uniform(seed, k, FAULT_OCCURRENCE + fault->code, fault->channel);
                if (drawn < fault->cycle[memory->away != 0]) memory->away = !memory->away;
            }
            acts = !memory->away;
        }
        memory->acting = acts;
        if (acts) {
            acting++;
            if (memory->last != step - 1.0) memory->onset = step;
            memory->last = step;
        }
    }
    return acting;
}

/* Return the command as changed by a fault; at its onset, memory->kept is set to the command. */
static double commanded(const hsv_fault *fault, hsv_fault_memory *memory, int64_t k, double period, double command)
{
    double value = fault->parameter[0];
    const int fresh = memory->onset == (double)k;
    if (fresh) memory->kept = command;
    switch (fault->code) {
    case LOSS: { /* paper eq. 14, eq. 15 */
        const double ramp = fault->parameter[1], elapsed = ((double)k - fault->start) * period;
        if (elapsed < ramp) value = 1.0 + (value - 1.0) * (elapsed / ramp);
        return value * command;
    }
    case REVERSAL: /* of the whole command (value 0), or of its change since the onset (value 1) */
        return 2.0 * value * memory->kept - command;
    case DELAY: {
        const int64_t size = whole(value, 0, MAX_DELAY) + 1;
        if (fresh)
            for (int64_t j = 0; j < size; j++) memory->queue[j] = command;
        memory->queue[k % size] = command;
        return memory->queue[(k + 1) % size];
    }
    case DEAD_ZONE: {
        const double off = command - memory->kept;
        if (magnitude(off) <= 0.5 * value) return memory->kept;
        return off > 0.0 ? command - 0.5 * value : command + 0.5 * value;
    }
    case BACKLASH:
        memory->kept = limited(memory->kept, command - 0.5 * value, command + 0.5 * value);
        return memory->kept;
    }
    return command;
}

/* Apply the faults to the command "actuator" (2), which then reaches the actuators. */
void hsv_apply_command_faults(hsv_faults *faults, int64_t k, int64_t seed, double *actuator)
{
    if (hsv_begin_faults(faults, k, seed) == 0) return;
    for (int64_t i = 0; i < faults->count; i++)
        if (faults->memory[i].acting && (uint64_t)faults->rows[i].channel < INPUTS) {
            double *channel = &actuator[faults->rows[i].channel];
            *channel = commanded(&faults->rows[i], &faults->memory[i], k, faults->period, *channel);
        }
}

/* Return whether the inlet is unstarted. It unstarts outside an ellipse in angle of attack and Mach number, or above a
 * limit of the equivalence ratio; it restarts with a hysteresis and not before a minimum time. */
static int unstarted(const hsv_fault *fault, hsv_fault_memory *memory, int64_t k, double period, double alpha,
                     double mach, double fuel)
{
    const double *p = fault->parameter, step = (double)k;
    if (memory->onset == step) memory->kept = 0.0;
    const double off_alpha = (alpha - p[5]) / p[6], off_mach = (mach - p[7]) / p[8], limit = p[9];
    const double distance = off_alpha * off_alpha + off_mach * off_mach;
    if (memory->kept == 0.0) {
        if (distance > 1.0 || fuel > limit) memory->kept = 1.0, memory->since = step;
    } else {
        const double regained = 1.0 - p[10];
        const int long_enough = (step - memory->since) * period >= p[11];
        if (long_enough && distance < regained * regained && fuel < regained * limit) memory->kept = 0.0;
    }
    return memory->kept == 1.0;
}

/* Write to "engine" the factors of thrust, lift and drag and the increment of C_M, for an angle of attack (rad) and a
 * Mach number relative to the air. Thrust factors multiply; the last of several unstarts sets the other effects. */
void hsv_apply_engine_faults(hsv_faults *faults, int64_t k, int64_t seed, double alpha, double mach, double fuel,
                             double *engine)
{
    engine[0] = engine[1] = engine[2] = 1.0, engine[3] = 0.0;
    if (hsv_begin_faults(faults, k, seed) == 0) return;
    for (int64_t i = 0; i < faults->count; i++) {
        const hsv_fault *fault = &faults->rows[i];
        hsv_fault_memory *memory = &faults->memory[i];
        if (!memory->acting) continue;
        if (fault->code == UNSTART_OUTSIDE && !unstarted(fault, memory, k, faults->period, alpha, mach, fuel)) continue;
        const double *p = fault->parameter;
        engine[0] *= p[0];
        if (fault->code != THRUST_LOSS) engine[1] = p[1], engine[2] = p[2], engine[3] = p[3] + p[4] * alpha;
    }
}
