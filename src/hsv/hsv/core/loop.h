/* The closed loop: the order of a step, common to nodes, replay and flights.
 *
 *   x(k)              state of the vehicle at t = k T
 *   y(k)              measurement of x(k)
 *   x^(k)             estimate of x(k), or y(k) without an estimator
 *   q_f(k), s(k)      notch filter (eq. 39), stepped with the pitch rate in x^(k)
 *   x_r, u_r, d_r     reference of the step and its defect
 *   u_n(k) = K x_n(k) nominal law (eq. 21; K by eq. 32 to eq. 35)
 *   u(k)              tube law or another controller, from x^(k), limited to U (eq. 36, eq. 29)
 *   x_n(k+1)          nominal system (eq. 20), scheduled by y(k)
 *   actuator(k)       u(k) after link and faults of the command (loss of effectiveness: eq. 14, eq. 15)
 *   x(k+1)            state of the plant with actuator(k) held over [k T, (k+1) T)
 *
 * x_n(0) = y(0) - x_r(0). A flight ends when its state leaves the range of the model. */
#pragma once
#include "effectiveness.h"
#include "estimator.h"
#include "metrics.h"
#include "nominal.h"
#include "plant.h"
#include "tube_law.h"

typedef struct {
    int equipped; /* whether any plant has non-ideal equipment */
    Vehicle vehicle, estimator_vehicle, tube_vehicle;
    TubeMemory tube;
    real predicted[STATES], known[KNOWN]; /* memory of the effectiveness estimator */
    LevelMemory levels;
    real x[STATES], measurement[STATES], estimator[ESTIMATED], notch[2 * MAX_SECTIONS];
    real x_n[STATES], u_n[INPUTS], gain_index, gain[INPUTS * STATES], u[INPUTS], actuator[INPUTS];
    real x_r[STATES], u_r[INPUTS], d_r[STATES];
    int64_t row[LANES], active[LANES]; /* index of reference row and gain in each lane */
} Loop;

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
/* Call the external nominal law and controller, if any; return 1 if the controller answered, -1 on failure, else 0. */
static inline int call_blocks(hsv_flight *flight, Loop *f, int64_t k, const double *feedback_state, double q_f,
                              const double *s, double *u_unsaturated)
{
    const hsv_call *law = &flight->nominal_law, *controller = &flight->controller;
    double found[INPUTS + 1];
    if (law->function) {
        if (law->function(k, f->x_n, found, law->state, law->par)) return -1;
        f->u_n[0] = found[0], f->u_n[1] = found[1], f->gain_index = found[INPUTS];
    } else if (flight->nominal->count > 0)
        nominal_input(flight->nominal, f->x_n, f->u_n, &f->gain_index);
    if (!controller->function) return 0;
    double in[3 * STATES + 1 + 2 * INPUTS + 2 * MAX_SECTIONS], *next = in; /* the order of hsv_block.h */
    memcpy(next, feedback_state, sizeof f->x), next += STATES;
    *next++ = q_f;
    memcpy(next, f->x_r, sizeof f->x_r), next += STATES;
    memcpy(next, f->u_r, sizeof f->u_r), next += INPUTS;
    memcpy(next, f->x_n, sizeof f->x_n), next += STATES;
    memcpy(next, f->u_n, sizeof f->u_n), next += INPUTS;
    memcpy(next, s, 2 * (size_t)flight->notch->sections * sizeof *s);
    u_unsaturated[0] = u_unsaturated[1] = NAN; /* so that an output that the controller does not set is noticed */
    flight->returned = controller->function(k, in, u_unsaturated, controller->state, controller->par);
    memcpy(flight->answer, u_unsaturated, sizeof flight->answer);
    return flight->returned == 0 && is_finite(u_unsaturated[0]) && is_finite(u_unsaturated[1]) ? 1 : -1;
}
#endif

/* Write row "line" of the histories of all lanes. */
static inline void write_rows(hsv_flight *const *flights, const Loop *f, int64_t line, const real *feedback_state,
                              real q_f, const real *x_n, const real *u_unsaturated)
{
    for (int i = 0; i < LANES; i++) {
        double *row = flights[i]->history + HISTORY * line, *auxiliary = flights[i]->auxiliary + AUXILIARY * line;
        read_lane(f->x, STATES, i, row), row += STATES;
        *row++ = lane(q_f, i);
        read_lane(x_n, STATES, i, row), row += STATES;
        read_lane(f->u_n, INPUTS, i, row), row += INPUTS;
        read_lane(f->u, INPUTS, i, row), row += INPUTS;
        read_lane(f->actuator, INPUTS, i, row);
        auxiliary[0] = lane(f->gain_index, i);
        read_lane(u_unsaturated, INPUTS, i, auxiliary + 1);
        if (flights[i]->estimated) read_lane(feedback_state, STATES, i, flights[i]->estimated + STATES * line);
    }
}

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

/* Simulate the steps start ... stop - 1 of a group of flights, which may differ in vehicle, seed, faults, reference,
 * gains of the tube law and parameters of the equipment only. Return the step after the last one, or -1 - k if an
 * external block failed in step k. */
static int64_t fly(hsv_flight *const *flights, Loop *f, int64_t start, int64_t stop)
{
    const hsv_flight *first = flights[0];
    const hsv_notch *notch = first->notch;
    const hsv_plant *plant = first->plant;
    if (start == 0) begin(flights, f);
    for (int64_t k = start; k < stop; k++) {
        real feedback_state[STATES], s[2 * MAX_SECTIONS], x_n[STATES], u_feedback[INPUTS], u_unsaturated[INPUTS];
        if (k > 0) {
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
        memcpy(feedback_state, f->measurement, sizeof feedback_state);
        if (first->estimator) {
            estimate_step(first->estimator, &f->estimator_vehicle, f->estimator, k, f->measurement, f->u,
                          feedback_state);
            if (k == 0) notch_rest(notch, feedback_state[PITCH_RATE], f->notch);
        }
        memcpy(s, f->notch, sizeof s);
        const real q_f = notch_step(notch, f->notch, feedback_state[PITCH_RATE]);
        int answered = 0;
#if LANES == 1
        flights[0]->history[HISTORY * (k - start) + STATES] =
            q_f; /* shows a monitoring process the current step */
        answered = call_blocks(flights[0], f, k, feedback_state, q_f, s, u_unsaturated);
        if (answered < 0) return -1 - k;
#else
        if (first->nominal->count > 0) nominal_input(first->nominal, f->x_n, f->u_n, &f->gain_index);
#endif
        if (answered)
            for (int j = 0; j < INPUTS; j++)
                f->u[j] = limited(u_unsaturated[j], first->tube->minimum[j], first->tube->maximum[j]);
        else {
            real effectiveness = all(1.0);
            if (first->tube->effectiveness)
                effectiveness = effectiveness_step(first->tube->effectiveness, &f->tube_vehicle, f->predicted, f->u,
                                                   f->known, k, feedback_state);
            tube_step(first->tube, &f->tube, f->gain, effectiveness, k, 0, 2 * notch->sections, feedback_state, q_f,
                      f->x_r, f->u_r, f->x_n, f->u_n, s, u_feedback, u_unsaturated, f->u);
        }
        memcpy(x_n, f->x_n, sizeof x_n);
        if (first->set) level_step(first->set, &f->levels, k, f->x, f->x_r, x_n);
        if (first->nominal->count > 0)
            nominal_advance(&first->nominal->polytope, f->measurement[ALTITUDE], f->measurement[VELOCITY], f->x_n,
                            f->u_n, f->d_r);
        memcpy(f->actuator, f->u, sizeof f->u);
        for (int i = 0; i < LANES; i++) {
            hsv_flight *own = flights[i];
            if (own->link->ideal && own->faults->count == 0) continue;
            double actuator[INPUTS];
            read_lane(f->actuator, INPUTS, i, actuator);
            hsv_receive(own->link, own->link_memory, own->payloads, k, own->plant->seed, actuator, INPUTS);
            hsv_apply_command_faults(own->faults, k, own->plant->seed, actuator);
            write_lane(actuator, INPUTS, i, f->actuator);
        }
        write_rows(flights, f, k - start, feedback_state, q_f, x_n, u_unsaturated);
        if (first->set)
            for (int i = 0; i < LANES; i++)
                if (flights[i]->ended > k) flights[i]->worst = lane(f->levels.worst, i);
        if (end_flights(flights, f, k)) return k + 1;
    }
    return stop;
}
