/* Set-membership estimator of the elevator effectiveness P in flight, from the pitch rate.
 *
 * In every step the equations of motion of the nominal vehicle predict the pitch rate at the end of the last period,
 * with the commanded and with zero elevator. The difference is the effect e (rad/s) of a healthy elevator. y is the
 * measured pitch rate minus the prediction with zero elevator. A vehicle with the declared uncertainty satisfies
 *
 *   (1 + i) D + b = P (1 + g) e + d + v,   y = D + b,
 *
 * where D is the measured change of the pitch rate, -b the predicted change with zero elevator, i and g the relative
 * errors of inertia and elevator, d a slow disturbance, and |v| at most a declared share of |e| plus noise. Every step
 * gives an interval for P. An interval without P = 1 indicates a fault. Two hypotheses are then tracked, each by the
 * intersection of its intervals in all steps: a loss of effectiveness (y - d proportional to e) and an offset
 * (y - d - e constant). While a loss explains all steps, the command is divided by the middle of the interval of P. */
#pragma once
#include "vehicle.h"

/* Modes. LOST: a loss of effectiveness explains all steps since the fault. OTHER: only an offset does. PENDING: a new
 * hypothesis has not yet explained the CONFIRMED steps that it needs to replace another. */
static const double HEALTHY = 0.0, LOST = 1.0, OTHER = 2.0, PENDING = 3.0, CONFIRMED = 5.0;

typedef struct {
    real low, high;
} Interval;

/* Return the value limited to a magnitude. */
static inline real within(real value, real greatest) { return minimum(maximum(value, -greatest), greatest); }

/* Return the interval in lanes where the hypothesis holds, else an empty interval that stays empty when widened. */
static inline Interval kept_where(mask holds, real low, real high)
{
    return (Interval){choose(holds, low, all(2.0)), choose(holds, high, all(-1.0))};
}

/* Write the interval of P that one step gives, clipped to the range of P, and the interval of the offset (rad/s). */
static inline void step_intervals(const hsv_effectiveness *data, real y, real e, real turn, real disturbance,
                                  real effect, Interval *loss, Interval *offset)
{
    const double g = data->effect;
    const real known = y - disturbance;
    const real margin = data->bound * magnitude(e) + data->inertia * magnitude(turn) + data->noise;
    const real strong = (known + g * effect) / ((1.0 + g) * e), weak = (known - g * effect) / ((1.0 - g) * e);
    const real reach = margin / ((1.0 - g) * magnitude(e));
    const real middle = known - e, wide = margin + g * magnitude(e - effect);
    const real low = minimum(strong, weak) - reach, high = maximum(strong, weak) + reach;
    /* An effectiveness below the range of P cannot be compensated by division. */
    *loss = kept_where(high >= data->least, minimum(maximum(low, all(data->least)), all(1.0)), minimum(high, all(1.0)));
    *offset = (Interval){middle - wide, middle + wide};
}

/* Update the estimates by one step in lanes where the step is usable; "turn" is D. */
static inline void judge(const hsv_effectiveness *data, real *known, mask usable, int first, real y, real e, real turn)
{
    const real mode = known[MODE];
    const mask healthy = mode == HEALTHY;
    /* A flight starts healthy: y - e in the first step is a disturbance, up to its bound. */
    const real greatest = data->offset * magnitude(e);
    real disturbance = first ? choose(healthy, within(y - e, greatest), known[DISTURBANCE]) : known[DISTURBANCE];
    const real effect = choose(healthy, e, known[EFFECT]);

    /* Intervals of this step, and their intersection with the earlier ones, which are widened by the drift. */
    Interval loss, offset;
    step_intervals(data, y, e, turn, disturbance, effect, &loss, &offset);
    const real widened = data->drift * magnitude(e);
    real low = maximum(maximum(known[LOW] - data->drift, all(data->least)), loss.low);
    real high = minimum(minimum(known[HIGH] + data->drift, all(1.0)), loss.high);
    real offset_low = maximum(known[OFFSET_LOW] - widened, offset.low);
    real offset_high = minimum(known[OFFSET_HIGH] + widened, offset.high);

    /* Restart with this step while healthy, and where neither hypothesis explains the steps. A first fault needs fewer
     * steps for confirmation than a fault that replaces another. */
    const mask begun = healthy | ((low > high) & (offset_low > offset_high));
    low = choose(begun, loss.low, low), high = choose(begun, loss.high, high);
    offset_low = choose(begun, offset.low, offset_low), offset_high = choose(begun, offset.high, offset_high);
    const real begin = choose(healthy, all(CONFIRMED + 1.0 - data->steps), all(1.0));
    const real count = choose(begun, begin, known[COUNT] + 1.0);

    const mask explained = low <= high, waiting = (begun | (mode == PENDING)) & (count < CONFIRMED);
    const real faulty = choose(explained, choose(high >= 1.0, all(HEALTHY), all(LOST)), all(OTHER));
    const real new = choose(healthy & (loss.high >= 1.0), all(HEALTHY), choose(waiting, all(PENDING), faulty));
    const real middle = 0.5 * (low + high);
    const real estimate = choose(new == PENDING, known[EFFECTIVENESS], choose(new == LOST, middle, all(1.0)));

    /* A difference beyond the bound is not a disturbance. */
    const real learned = disturbance + data->learning * within(y - e - disturbance, data->bound * magnitude(e));
    disturbance = choose(healthy & (new == HEALTHY), within(learned, greatest), disturbance);
    const Interval kept = kept_where(explained, low, high);
    const Interval kept_offset = kept_where(offset_low <= offset_high, offset_low, offset_high);
    const real update[KNOWN] = {estimate,
                                kept.low,
                                kept.high,
                                kept_offset.low,
                                kept_offset.high,
                                disturbance,
                                choose(new == HEALTHY, e, known[EFFECT]),
                                new,
                                count};
    for (int i = 0; i < KNOWN; i++) known[i] = choose(usable, update[i], known[i]);
}

/* Return the effectiveness by which the elevator command of step k is divided. A step does not change the estimates if
 * its measurement is not finite or the elevator has no effect.
 *
 * predicted: state of the previous step, with measured rigid and predicted elastic states; held: input since then;
 * known: the estimates; x: the measured state of step k. */
static inline real effectiveness_step(const hsv_effectiveness *data, const Vehicle *vehicle, real *predicted,
                                      const real *held, real *known, int64_t k, const real *x)
{
    if (k == 0) {
        for (int i = 0; i < STATES; i++) predicted[i] = all(data->start[i]);
        for (int i = 0; i < KNOWN; i++) known[i] = all(i <= HIGH ? 1.0 : 0.0);
    } else {
        real with[STATES], without[STATES];
        const real idle[INPUTS] = {held[FUEL], all(0.0)};
        memcpy(with, predicted, sizeof with);
        memcpy(without, predicted, sizeof without);
        advance(with, held, vehicle, NULL, all(data->period), 1);
        advance(without, idle, vehicle, NULL, all(data->period), 1);
        const real y = x[PITCH_RATE] - without[PITCH_RATE], e = with[PITCH_RATE] - without[PITCH_RATE];
        const real turn = x[PITCH_RATE] - predicted[PITCH_RATE];
        const mask usable = is_finite(y) & is_finite(e) & (magnitude(e) > 1e-9);
        judge(data, known, usable, k == 1, choose(usable, y, all(1.0)), choose(usable, e, all(1.0)),
              choose(usable, turn, all(0.0)));
        /* A loss affects the elastic modes before it is confirmed. */
        const mask unsure = (known[MODE] == PENDING) & (known[LOW] <= known[HIGH]);
        const real felt = choose(unsure, 0.5 * (known[LOW] + known[HIGH]), known[EFFECTIVENESS]);
        for (int i = RIGID; i < STATES; i++) {
            const real now = without[i] + felt * (with[i] - without[i]);
            predicted[i] = choose(is_finite(now), now, predicted[i]);
        }
    }
    for (int i = 0; i < RIGID; i++) predicted[i] = x[i];
    return known[EFFECTIVENESS];
}
