/* Actuators of first and second order with limits, discretised exactly, and faults of actuators and effectors.
 *
 *   order 1: dp/dt = omega (c - p),   order 2: d2p/dt2 = omega^2 (c - p) - 2 zeta omega dp/dt
 *
 * with position p and command c, which is held (parameters and order of the limits: Zipfel's CADAC GHAME6, Wiese's
 * generic hypersonic vehicle). Actuators and vehicle are advanced by substeps, a quarter of the control period; over a
 * substep the vehicle sees the mean of the two end positions. An ideal actuator reaches its command at once.
 *
 * Effects act in this order: dynamics, with limits that faults may have narrowed; scale, bias, drift and oscillation of
 * the effector; faults that replace its position, of which the last in the list prevails; the stops. */
#pragma once
#include "faults.h"

enum { POSITION, RATE };

/* Write F11, F12, F21, F22, the transition of (position - command, rate) over h (s); it is not used for order 0. */
void hsv_actuator_map(int64_t order, double frequency, double damping, double h, double *map)
{
    if (order == 1) {
        map[0] = exponential(-frequency * h), map[1] = map[2] = map[3] = 0.0;
        return;
    }
    const double decay = exponential(-damping * frequency * h), damped = frequency * root(1.0 - damping * damping);
    double sine, cosine;
    sine_cosine(damped * h, &sine, &cosine);
    const double scaled = damped > 0.0 ? sine / damped : h;
    map[0] = decay * (cosine + damping * frequency * scaled);
    map[1] = decay * scaled;
    map[2] = -frequency * frequency * decay * scaled;
    map[3] = decay * (cosine - damping * frequency * scaled);
}

/* Write position, rate and mean position h (s) later, from "state" (position, rate). If a fault moves a stop, a
 * position beyond it may stay or return, but not move further out. An equilibrium is kept to the bit. */
void hsv_actuator_step(int64_t order, const double *map, const double *state, double command, double minimum_stop,
                       double maximum_stop, double rate_limit, double acceleration_limit, double h, double *out)
{
    const double position = state[POSITION], rate = state[RATE], target = limited(command, minimum_stop, maximum_stop);
    double moved = target, speed = 0.0;
    if (order == 2) {
        const double error = position - target, change = acceleration_limit * h;
        moved = target + (map[0] * error + map[1] * rate);
        speed = limited(map[2] * error + map[3] * rate, rate - change, rate + change);
        speed = limited(speed, -rate_limit, rate_limit);
    } else if (order == 1)
        moved = target + map[0] * (position - target);
    const double reach = rate_limit * h;
    if (magnitude(moved - position) > reach) moved = position + (moved > position ? reach : -reach);
    const double low = minimum(minimum_stop, position), high = maximum(maximum_stop, position);
    if (moved <= low)
        moved = low, speed = maximum(speed, 0.0);
    else if (moved >= high)
        moved = high, speed = minimum(speed, 0.0);
    if (order < 2) speed = (moved - position) / h;
    out[0] = moved, out[1] = speed;
    out[2] = order > 0 || rate_limit < INFINITY ? 0.5 * (position + moved) : moved;
}

/* Return the position of an effector with a fault, "elapsed" (s) after the start of the fault and "since" (s) after its
 * last onset. If the fault replaces the position, set "held": whether the actuator is held there, too. */
static double deflected(const hsv_fault *fault, const hsv_fault_memory *memory, double elapsed, double since,
                        double alpha, double position, int *held)
{
    const double *p = fault->parameter;
    switch (fault->code) {
    case SCALE: return p[0] * position;
    case BIAS: return position + p[0];
    case DRIFT: return position + limited(p[0] * elapsed, -p[1], p[1]);
    case OSCILLATION:
    case SOLID_OSCILLATION: {
        const double turns = p[1] * elapsed;
        double sine, cosine;
        sine_cosine(6.283185307179586 * (turns - __builtin_floor(turns)) + p[2], &sine, &cosine);
        if (fault->code == OSCILLATION) return position + p[0] * sine;
        return *held = 1, memory->kept + p[0] * sine;
    }
    case LOCK: return *held = 1, memory->kept;
    case LOCK_AT: return *held = 1, p[0];
    case FLOAT: /* zero, or aligned with the flow */ return *held = 0, -p[0] * alpha;
    case HARD_OVER: return *held = 1, memory->kept + p[0] * since;
    }
    return position;
}

/* Advance the actuators, state (2, 2), by "length" substeps, beginning at "substep" of step k; write the positions of
 * the effectors (2), which are means over that time. */
void hsv_move_effectors(const hsv_actuators *actuators, double *state, hsv_faults *faults, int64_t k, double substep,
                        double length, const double *command, double alpha, double *effector)
{
    const double middle = (substep + 0.5 * length) * actuators->substep, h = length * actuators->substep;
    for (int channel = 0; channel < INPUTS; channel++) {
        int64_t order = actuators->order[channel];
        double frequency = actuators->natural_frequency[channel], rate = actuators->rate_limit[channel];
        double low = actuators->minimum[channel], high = actuators->maximum[channel];
        double own_map[4], moved[3];
        const double *map = actuators->map[channel];
        int changed = length != 1.0;
        for (int64_t i = 0; i < faults->count; i++) {
            const hsv_fault *fault = &faults->rows[i];
            if (!faults->memory[i].acting || fault->channel != channel) continue;
            if (fault->code == BANDWIDTH && fault->parameter[0] < frequency) {
                frequency = fault->parameter[0];
                order = order > 1 ? order : 1;
                changed = 1;
            } else if (fault->code == RATE_LIMIT)
                rate = minimum(rate, fault->parameter[0]);
            else if (fault->code == STOP_LIMIT)
                low = maximum(low, fault->parameter[0]), high = minimum(high, fault->parameter[1]);
        }
        if (changed) {
            hsv_actuator_map(order, frequency, actuators->damping_ratio[channel], h, own_map);
            map = own_map;
        }
        double *own = state + 2 * channel;
        hsv_actuator_step(order, map, own, command[channel], low, high, rate, actuators->acceleration_limit[channel], h,
                          moved);
        double position = moved[2];
        int held = 0;
        for (int64_t i = 0; i < faults->count; i++) {
            const hsv_fault *fault = &faults->rows[i];
            hsv_fault_memory *memory = &faults->memory[i];
            if (!memory->acting || fault->channel != channel) continue;
            if (memory->onset == (double)k && substep == 0.0) memory->kept = effector[channel];
            const double elapsed = ((double)k - fault->start) * faults->period + middle;
            const double since = ((double)k - memory->onset) * faults->period + middle;
            position = deflected(fault, memory, elapsed, since, alpha, position, &held);
        }
        position = limited(position, actuators->minimum[channel], actuators->maximum[channel]);
        /* An actuator that is held continues from there after the fault. */
        own[POSITION] = held ? position : moved[0];
        own[RATE] = held ? 0.0 : moved[1];
        effector[channel] = position;
    }
}
