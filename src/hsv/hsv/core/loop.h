/* The closed loop: one step in the order that nodes, replay and flights have in common.
 *
 *   x(k)              state of the vehicle at t = k T
 *   y(k)              measurement of x(k)
 *   x^(k)             estimate of x(k), or y(k) without an estimator
 *   q_f(k), s(k)      output and state of the notch filter (eq. 39), whose input is the pitch rate in x^(k)
 *   x_r, u_r, d_r     reference of step k and its defect
 *   u_n(k) = K x_n(k) nominal law (eq. 21; K by eq. 32 to eq. 35)
 *   u(k)              tube law or another controller, from x^(k), limited to U (eq. 36, eq. 29)
 *   x_n(k+1)          nominal system (eq. 20), scheduled by y(k)
 *   actuator(k)       u(k) after link and faults of the command (loss of effectiveness: eq. 14, eq. 15)
 *   x(k+1)            state of the plant with actuator(k) held over [k T, (k+1) T)
 *
 * with x_n(0) = y(0) - x_r(0). A flight ends when its state leaves the range of the model.
 *
 * A step has two halves: "sense" ends with the nominal law u_n(k), "act" begins with the input u(k). A program that
 * computes u(k) itself calls one half at a time. */
#pragma once
#include "effectiveness.h"
#include "estimator.h"
#include "foreign.h"
#include "metrics.h"
#include "nominal.h"
#include "plant.h"
#include "tube_law.h"

typedef struct {
    int equipped; /* whether the plant of any lane has equipment that is not ideal */
    Vehicle vehicle, estimator_vehicle, tube_vehicle;
    TubeMemory tube;
    real predicted[STATES], known[KNOWN]; /* memory of the effectiveness estimator */
    LevelMemory levels;
    real x[STATES], measurement[STATES], estimator[ESTIMATED], notch[2 * MAX_SECTIONS];
    real x_n[STATES], u_n[INPUTS], gain_index, gain[INPUTS * STATES], u[INPUTS], actuator[INPUTS];
    real x_r[STATES], u_r[INPUTS], d_r[STATES];
    real feedback_state[STATES], s[2 * MAX_SECTIONS], q_f; /* results of the first half of a step for the second half */
    int64_t row[LANES], active[LANES];                     /* index of the loaded reference row and gain of each lane */
} Loop;

/* Write the measurement y(k), as it arrives over the link, in every lane. */
static inline void measure_lanes(hsv_flight *const *flights, Loop *f, int64_t k)
{
    if (!f->equipped) {
        memcpy(f->measurement, f->x, sizeof f->x);
        return;
    }
    for (int i = 0; i < LANES; i++) {
        double x[STATES], y[STATES];
        read_lane(f->x, STATES, i, x);
        hsv_sense(flights[i]->plant, flights[i]->plant_memory, flights[i]->plant_faults, k, x, y);
        write_lane(y, STATES, i, f->measurement);
    }
}

/* Load the reference row and the tube-law gain of step k in every lane. */
static inline void schedule_lanes(hsv_flight *const *flights, Loop *f, int64_t k)
{
    for (int i = 0; i < LANES; i++) {
        const hsv_reference *reference = flights[i]->reference;
        int64_t row = k - reference->first;
        row = row < 0 ? 0 : row < reference->rows ? row : reference->rows - 1;
        if (row != f->row[i]) {
            f->row[i] = row;
            write_lane(reference->state + STATES * row, STATES, i, f->x_r);
            write_lane(reference->input + INPUTS * row, INPUTS, i, f->u_r);
            write_lane(reference->defect + STATES * row, STATES, i, f->d_r);
        }
        const int64_t active = active_gain(flights[i]->tube, k);
        if (active != f->active[i]) {
            f->active[i] = active;
            write_lane(flights[i]->tube->gains + INPUTS * STATES * active, INPUTS * STATES, i, f->gain);
        }
    }
}

/* Initialise the loop for step 0. All flights of a group have the estimator and the notch filter of the first one. */
static inline void begin(hsv_flight *const *flights, Loop *f)
{
    const hsv_flight *first = flights[0];
    memset(f, 0, sizeof *f);
    for (int i = 0; i < LANES; i++) {
        f->row[i] = f->active[i] = -1;
        f->equipped |= is_equipped(flights[i]->plant, flights[i]->plant_faults);
        write_lane(flights[i]->x, STATES, i, f->x);
        gather_vehicle(&flights[i]->plant->vehicle, i, &f->vehicle);
        if (first->estimator) gather_vehicle(&first->estimator->vehicle, i, &f->estimator_vehicle);
        if (first->tube->effectiveness) gather_vehicle(&first->tube->effectiveness->vehicle, i, &f->tube_vehicle);
    }
    measure_lanes(flights, f, 0);
    notch_rest(first->notch, f->measurement[PITCH_RATE], f->notch);
    schedule_lanes(flights, f, 0);
    if (first->nominal->count > 0)
        for (int i = 0; i < STATES; i++) f->x_n[i] = f->measurement[i] - f->x_r[i];
}

#if LANES == 1
/* Call the external nominal law, which writes u_n and the index of its gain; return -1 on failure, else 0. */
static inline int call_nominal_law(hsv_flight *flight, Loop *f, int64_t k)
{
    double found[INPUTS + 1];
    if (call_step(&flight->nominal_law, k, f->x_n, found, INPUTS + 1)) return -1;
    f->u_n[0] = found[0], f->u_n[1] = found[1], f->gain_index = found[INPUTS];
    return 0;
}

/* Call the external controller; return -1 on failure, else 0. */
static inline int call_controller(hsv_flight *flight, const Loop *f, int64_t k, double *u_unsaturated)
{
    double in[3 * STATES + 1 + 2 * INPUTS + 2 * MAX_SECTIONS], *next = in; /* the order of hsv_block.h */
    memcpy(next, f->feedback_state, sizeof f->feedback_state), next += STATES;
    *next++ = f->q_f;
    memcpy(next, f->x_r, sizeof f->x_r), next += STATES;
    memcpy(next, f->u_r, sizeof f->u_r), next += INPUTS;
    memcpy(next, f->x_n, sizeof f->x_n), next += STATES;
    memcpy(next, f->u_n, sizeof f->u_n), next += INPUTS;
    memcpy(next, f->s, 2 * (size_t)flight->notch->sections * sizeof *f->s);
    flight->returned = call_step(&flight->controller, k, in, u_unsaturated, INPUTS);
    memcpy(flight->answer, u_unsaturated, sizeof flight->answer);
    return flight->returned == 0 && is_finite(u_unsaturated[0]) && is_finite(u_unsaturated[1]) ? 0 : -1;
}
#endif

/* End the flights that have left the range of the model in step k; return whether all have ended. */
static inline int end_flights(hsv_flight *const *flights, const Loop *f, int64_t k)
{
    const mask inside = in_model_range(f->x, flights[0]->plant->vehicle.angle_limit);
    if (every(inside)) return 0;
    int flying = 0;
    for (int i = 0; i < LANES; i++)
        if (flights[i]->ended > k) {
            if (lane(inside, i))
                flying++;
            else
                flights[i]->ended = k + 1;
        }
    return flying == 0;
}

/* The first half of step k: advance the plants to x(k), measure, filter, and compute the nominal input. Write x, q_f,
 * x_n and u_n to row "line" of the histories. Return -1 if an external nominal law failed, else 0. */
static inline int sense(hsv_flight *const *flights, Loop *f, int64_t k, int64_t line)
{
    const hsv_flight *first = flights[0];
    const hsv_plant *plant = first->plant;
    if (k == 0)
        begin(flights, f);
    else {
        if (f->equipped)
            advance_plants(flights, &f->vehicle, k - 1, f->actuator, f->x);
        else {
            real effector[INPUTS];
            for (int j = 0; j < INPUTS; j++)
                effector[j] = limited(f->actuator[j], plant->actuators.minimum[j], plant->actuators.maximum[j]);
            advance(f->x, effector, &f->vehicle, NULL, all(plant->period), plant->substeps);
        }
        measure_lanes(flights, f, k);
        schedule_lanes(flights, f, k);
    }
    memcpy(f->feedback_state, f->measurement, sizeof f->feedback_state);
    if (first->estimator) {
        estimate_step(first->estimator, &f->estimator_vehicle, f->estimator, k, f->measurement, f->u,
                      f->feedback_state);
        if (k == 0) notch_rest(first->notch, f->feedback_state[PITCH_RATE], f->notch);
    }
    memcpy(f->s, f->notch, sizeof f->s);
    f->q_f = notch_step(first->notch, f->notch, f->feedback_state[PITCH_RATE]);
#if LANES == 1
    if (first->nominal_law.function) {
        if (call_nominal_law(flights[0], f, k)) return -1;
    } else
#endif
        if (first->nominal->count > 0)
        nominal_input(first->nominal, f->x_n, f->u_n, &f->gain_index);
    for (int i = 0; i < LANES; i++) {
        double *row = flights[i]->history + HISTORY * line;
        read_lane(f->x, STATES, i, row), row += STATES;
        *row++ = lane(f->q_f, i); /* shows a monitoring process the current step */
        read_lane(f->x_n, STATES, i, row), row += STATES;
        read_lane(f->u_n, INPUTS, i, row);
        if (flights[i]->estimated) read_lane(f->feedback_state, STATES, i, flights[i]->estimated + STATES * line);
    }
    return 0;
}

/* The second half of step k: compute u(k) by the tube law or an external controller, or take "commanded"; advance the
 * nominal state; pass u(k) through the link and the faults of the command. Write the rest of row "line". Return -1 if
 * an external controller failed, 1 if all flights have ended, else 0. */
static inline int act(hsv_flight *const *flights, Loop *f, int64_t k, int64_t line)
{
    const hsv_flight *first = flights[0];
    real u_unsaturated[INPUTS];
    int external = first->commanded != NULL;
    for (int i = 0; external && i < LANES; i++) write_lane(flights[i]->commanded, INPUTS, i, u_unsaturated);
#if LANES == 1
    if (first->controller.function) {
        if (call_controller(flights[0], f, k, u_unsaturated)) return -1;
        external = 1;
    }
#endif
    if (external)
        for (int j = 0; j < INPUTS; j++)
            f->u[j] = limited(u_unsaturated[j], first->tube->minimum[j], first->tube->maximum[j]);
    else {
        real u_feedback[INPUTS], effectiveness = all(1.0);
        if (first->tube->effectiveness)
            effectiveness = effectiveness_step(first->tube->effectiveness, &f->tube_vehicle, f->predicted, f->u,
                                               f->known, k, f->feedback_state);
        tube_step(first->tube, &f->tube, f->gain, effectiveness, k, 0, 2 * first->notch->sections, f->feedback_state,
                  f->q_f, f->x_r, f->u_r, f->x_n, f->u_n, f->s, u_feedback, u_unsaturated, f->u);
    }
    if (first->set) level_step(first->set, &f->levels, k, f->x, f->x_r, f->x_n);
    if (first->nominal->count > 0)
        nominal_advance(&first->nominal->polytope, f->measurement[ALTITUDE], f->measurement[VELOCITY], f->x_n, f->u_n,
                        f->d_r);
    memcpy(f->actuator, f->u, sizeof f->u);
    for (int i = 0; i < LANES; i++) {
        hsv_flight *own = flights[i];
        double *row = own->history + HISTORY * line + ACTED, *auxiliary = own->auxiliary + AUXILIARY * line;
        if (!own->link->ideal || own->faults->count > 0) {
            double actuator[INPUTS];
            read_lane(f->actuator, INPUTS, i, actuator);
            hsv_receive(own->link, own->link_memory, own->payloads, k, own->plant->seed, actuator, INPUTS);
            hsv_apply_command_faults(own->faults, k, own->plant->seed, actuator);
            write_lane(actuator, INPUTS, i, f->actuator);
        }
        read_lane(f->u, INPUTS, i, row);
        read_lane(f->actuator, INPUTS, i, row + INPUTS);
        auxiliary[0] = lane(f->gain_index, i);
        read_lane(u_unsaturated, INPUTS, i, auxiliary + 1);
        if (first->set && own->ended > k) own->worst = lane(f->levels.worst, i);
    }
    return end_flights(flights, f, k);
}

/* Simulate the steps start ... stop - 1, or one half of each, of a group of flights. The flights may differ only in
 * vehicle, seed, faults, reference, gains of the tube law and parameters of the equipment. Return the step after the
 * last one, or -1 - k if an external block failed in step k. */
static int64_t fly(hsv_flight *const *flights, Loop *f, int64_t start, int64_t stop, int halves)
{
    for (int64_t k = start; k < stop; k++) {
        if (halves & SENSE && sense(flights, f, k, k - start) < 0) return -1 - k;
        const int ended = halves & ACT ? act(flights, f, k, k - start) : 0;
        if (ended < 0) return -1 - k;
        if (ended) return k + 1;
    }
    return stop;
}
