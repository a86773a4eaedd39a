/* Sensors, one for each state x:
 *
 *   y = fault(clip(quantise(hold(delay(lag((1 + s) x) + b + n)))))
 *
 * with scale error s, lag, bias b (constant, Gauss-Markov drift and random walk), white noise n, latency in samples,
 * hold of the last sample during a drop-out, quantisation, range and faults. An ideal sensor returns its state to the
 * bit. In step 0 lags are in equilibrium and queues contain the first sample. */
#pragma once
#include "faults.h"
#include "vehicle.h"

static inline int is_noisy(const hsv_sensors *s, int i) { return s->noise[i] > 0.0 || s->drift_sigma[i] > 0.0; }

/* Return the error b + n in step k. Two normal numbers are given for white noise and drift, or NULL to a sensor without
 * them; values that are constant in a flight are drawn in step 0. */
static double sensor_error(const hsv_sensors *s, hsv_sensor_memory *m, int i, int64_t k, int64_t seed,
                           const double *drawn)
{
    if (k == 0) {
        double constant[2];
        hsv_normals(seed, 0, SENSOR_CONSTANTS + i, 0, constant);
        m->bias = s->bias[i] + s->bias_sigma[i] * constant[0];
        m->scale = s->scale[i] + s->scale_sigma[i] * constant[1];
        m->walk = 0.0;
    }
    double error = m->bias;
    if (drawn) {
        error += s->noise[i] * drawn[0];
        if (s->drift_sigma[i] > 0.0) {
            const double decay = s->drift_decay[i], share = root(maximum(1.0 - decay * decay, 0.0));
            m->drift = k == 0 ? s->drift_sigma[i] * drawn[1] : decay * m->drift + s->drift_sigma[i] * share * drawn[1];
            error += m->drift;
        }
    }
    if (s->walk[i] > 0.0 && k > 0) m->walk += s->walk[i] * first_normal(seed, k, SENSOR_NOISE_STREAM + i, 1);
    return error + m->walk;
}

/* Return the measurement of a sensor without faults; "error" is b + n. */
static double sensor_sample(const hsv_sensors *s, hsv_sensor_memory *m, int i, int64_t k, int64_t seed, double x,
                            double error)
{
    const double scaled = (1.0 + m->scale) * x;
    m->lagged = k == 0 ? scaled : scaled + s->lag_decay[i] * (m->lagged - scaled);
    double value = m->lagged + error;
    if (s->latency[i] > 0) {
        const int64_t size = 1 + (s->latency[i] < MAX_DELAY ? s->latency[i] : MAX_DELAY);
        if (k == 0)
            for (int64_t j = 0; j < size; j++) m->queue[j] = value;
        m->queue[k % size] = value;
        value = m->queue[(k + 1) % size];
    }
    if (s->drop_out[i] > 0.0 && k > 0 && first_uniform(seed, k, SENSOR_LOSS + i, 0) < s->drop_out[i]) return m->held;
    if (s->quantum[i] > 0.0) value = s->quantum[i] * __builtin_floor(value / s->quantum[i] + 0.5);
    m->held = limited(value, s->minimum[i], s->maximum[i]);
    return m->held;
}

/* Return the measurement "value" as changed by a fault; "given" is the measurement of the previous step. */
static double sensor_failed(const hsv_fault *fault, hsv_fault_memory *memory, int64_t k, int64_t seed, double period,
                            double value, double given)
{
    const double first = fault->parameter[0], limit = fault->parameter[1];
    const int fresh = memory->onset == (double)k;
    const int64_t draw = whole(fault->start, 0, MOST_STEPS);
    switch (fault->code) {
    case SENSOR_SCALE: return first * value;
    case SENSOR_NOISE: return value + first * first_normal(seed, k, SENSOR_FAULT_NOISE + fault->channel, draw);
    case SENSOR_BIAS: return value + first;
    case SENSOR_RUNAWAY: return value + limited(first * (((double)k - fault->start) * period), -limit, limit);
    case SENSOR_DROP_OUT:
        if (fresh) memory->kept = k > 0 ? given : value;
        if (first_uniform(seed, k, SENSOR_FAULT_LOSS + fault->channel, draw) >= first) memory->kept = value;
        return memory->kept;
    case SENSOR_FREEZE:
        if (fresh) memory->kept = value;
        return memory->kept;
    }
    return value;
}

/* Write the measurement (9) of the state x (9) in step k; steps must be consecutive from 0. */
void hsv_measure(const hsv_sensors *sensors, hsv_sensor_memory *memory, hsv_faults *faults, int64_t k, int64_t seed,
                 const double *x, double *measurement)
{
    const int64_t failing = hsv_begin_faults(faults, k, seed);
    double pitch_error = 0.0, drawn[STATES][2];
    int64_t streams[STATES];
    int noisy = 0, next = 0;
    for (int i = STATES - 1; i >= 0; i--)
        if (sensors->on[i] && is_noisy(sensors, i)) streams[noisy++] = SENSOR_NOISE_STREAM + i;
    normals(seed, k, streams, 0, noisy, drawn);
    /* In reverse order, because the angle of attack may need the error of the pitch angle, which comes after it. */
    for (int i = STATES - 1; i >= 0; i--) {
        measurement[i] = x[i];
        if (!sensors->on[i]) continue;
        double error = sensor_error(sensors, &memory[i], i, k, seed, is_noisy(sensors, i) ? drawn[next++] : NULL);
        if (i == PITCH)
            pitch_error = error;
        else if (i == ALPHA && sensors->inertial_angle_of_attack)
            error += pitch_error;
        measurement[i] = sensor_sample(sensors, &memory[i], i, k, seed, x[i], error);
    }
    if (failing > 0)
        for (int64_t j = 0; j < faults->count; j++)
            if (faults->memory[j].acting && (uint64_t)faults->rows[j].channel < STATES) {
                const hsv_fault *fault = &faults->rows[j];
                double *value = &measurement[fault->channel];
                *value = sensor_failed(fault, &faults->memory[j], k, seed, faults->period, *value,
                                       memory[fault->channel].given);
            }
    for (int i = 0; i < STATES; i++) memory[i].given = measurement[i];
}
