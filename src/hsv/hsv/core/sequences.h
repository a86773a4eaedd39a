/* Simulations over many steps: the plan of the governor, filters along trajectories, and random sequences. */
#pragma once
#include "nominal.h"
#include "noise.h"
#include "notch_filter.h"
#include "vehicle.h"

/* Write [A(p), B(p)] (9, 11) row by row (eq. 12), p the altitude and velocity; return whether p is in the envelope. */
int hsv_schedule(const hsv_polytope *polytope, double altitude, double velocity, double *S)
{
    double weights[MAX_VERTICES], entries[MAX_SIZE];
    const int inside = vertex_weights(polytope, altitude, velocity, weights);
    weighted_entries(polytope, weights, entries);
    memset(S, 0, ENTRIES * sizeof *S);
    for (int64_t e = 0; e < polytope->used; e++) S[polytope->entries[e]] = entries[e];
    return inside;
}

/* Write the plan u_r + u_n (steps, 2) and x_n (steps, 9) from step "first" on, where x_n is "start". The model is
 * scheduled by x_r + x_n. Return whether x_n stays in the ellipsoids of the nominal law. */
int hsv_plan(const hsv_nominal *nominal, const hsv_reference *reference, int64_t first, int64_t steps,
             const double *start, double *plan, double *deviation)
{
    double x_n[STATES], u_n[INPUTS], index;
    int held = 1;
    memcpy(x_n, start, sizeof x_n);
    for (int64_t k = 0; k < steps; k++) {
        int64_t row = first + k - reference->first;
        row = row < 0 ? 0 : row < reference->rows ? row : reference->rows - 1;
        const double *x_r = reference->state + STATES * row, *u_r = reference->input + INPUTS * row;
        memcpy(deviation + STATES * k, x_n, sizeof x_n);
        held &= nominal_input(nominal, x_n, u_n, &index);
        for (int i = 0; i < INPUTS; i++) plan[INPUTS * k + i] = u_r[i] + u_n[i];
        nominal_advance(&nominal->polytope, x_r[ALTITUDE] + x_n[ALTITUDE], x_r[VELOCITY] + x_n[VELOCITY], x_n, u_n,
                        reference->defect + STATES * row);
    }
    return held;
}

/* Filter the rates (steps), from the equilibrium for the first one; write the filtered rates (steps) and the states of
 * the filter (steps, 2 sections) before each step. */
void hsv_notch_along(const hsv_notch *notch, int64_t steps, const double *rate, double *filtered, double *states)
{
    double s[2 * MAX_SECTIONS] = {0};
    const size_t count = 2 * (size_t)notch->sections;
    if (steps > 0) notch_rest(notch, rate[0], s);
    for (int64_t k = 0; k < steps; k++) {
        memcpy(states + (size_t)k * count, s, count * sizeof *s);
        filtered[k] = notch_step(notch, s, rate[k]);
    }
}

/* Add C a + D c to the output (2), and replace the state a by A a + B c. */
static void respond_once(const hsv_sampled *f, const double *c, double *a, double *output)
{
    const int64_t n = f->states;
    double new[4] = {0};
    for (int i = 0; i < INPUTS; i++) {
        for (int64_t j = 0; j < n; j++) output[i] += f->C[n * i + j] * a[j];
        for (int j = 0; j < INPUTS; j++) output[i] += f->D[INPUTS * i + j] * c[j];
    }
    for (int64_t i = 0; i < n; i++) {
        for (int64_t j = 0; j < n; j++) new[i] += f->A[n * i + j] * a[j];
        for (int j = 0; j < INPUTS; j++) new[i] += f->B[INPUTS * i + j] * c[j];
    }
    memcpy(a, new, (size_t)n * sizeof *a);
}

/* Write the actuator states (steps, states) before each step and the mean positions (steps, 2) for the commands
 * (steps, 2). */
void hsv_respond(const hsv_sampled *actuators, int64_t steps, const double *commands, double *before, double *means)
{
    double a[4] = {0};
    memset(means, 0, (size_t)(INPUTS * steps) * sizeof *means);
    for (int64_t k = 0; k < steps; k++) {
        memcpy(before + actuators->states * k, a, (size_t)actuators->states * sizeof *a);
        respond_once(actuators, commands + INPUTS * k, a, means + INPUTS * k);
    }
}

/* Write the response of the closed loop to the lag of the plan: errors (steps, 5 + filter + actuator states), initially
 * zero, and feedback (steps, 2); see hsv.design.error_system.
 *
 * gain (2, 5): F; scheduled (steps, 2): altitude (m) and velocity (m/s) that schedule the model; lag (steps, 2): mean
 * position of actuators that are driven by the plan, minus the plan. */
void hsv_lag_response(const hsv_polytope *polytope, const double *gain, const hsv_notch *notch,
                      const hsv_sampled *actuators, int64_t steps, const double *scheduled, const double *lag,
                      double *errors, double *feedback)
{
    double x[RIGID] = {0}, new[RIGID], s[2 * MAX_SECTIONS] = {0}, a[4] = {0}, S[ENTRIES];
    const int64_t states = actuators->states, filter = 2 * notch->sections, width = RIGID + filter + states;
    for (int64_t k = 0; k < steps; k++) {
        double *error = errors + width * k, *own = feedback + INPUTS * k;
        memcpy(error, x, sizeof x);
        memcpy(error + RIGID, s, (size_t)filter * sizeof *s);
        memcpy(error + RIGID + filter, a, (size_t)states * sizeof *a);
        hsv_schedule(polytope, scheduled[2 * k], scheduled[2 * k + 1], S);
        const double filtered = notch_step(notch, s, x[PITCH_RATE]);
        double held[INPUTS] = {lag[INPUTS * k], lag[INPUTS * k + 1]};
        for (int i = 0; i < INPUTS; i++) {
            own[i] = gain[RIGID * i + PITCH_RATE] * filtered;
            for (int j = 0; j < RIGID; j++)
                if (j != PITCH_RATE) own[i] += gain[RIGID * i + j] * x[j];
        }
        respond_once(actuators, own, a, held);
        for (int i = 0; i < RIGID; i++) {
            const double *row = S + (STATES + INPUTS) * i;
            new[i] = 0.0;
            for (int j = 0; j < RIGID; j++) new[i] += row[j] * x[j];
            for (int j = 0; j < INPUTS; j++) new[i] += row[STATES + j] * held[j];
        }
        memcpy(x, new, sizeof x);
    }
}

/* Test of an ellipsoid by random sequences of vertices and disturbances, see hsv.flight.random_sequences. */
enum { MAX_WIDTH = 32 };
#define GOLDEN UINT64_C(0x9E3779B97F4A7C15)

/* Return 64 random bits for a counter, by splitmix64. */
static uint64_t mix(uint64_t state)
{
    uint64_t z = (state ^ (state >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

static double square(const double *v, int64_t width)
{
    double total = 0.0;
    for (int64_t i = 0; i < width; i++) total += v[i] * v[i];
    return total;
}

static void add_column(const double *column, double value, int64_t width, double *sum)
{
    for (int64_t i = 0; i < width; i++) sum[i] += column[i] * value;
}

/* Write the successor of v at a vertex. The rows of "vertex" are matrix columns: for the n states, for the
 * disturbances, which are 1 or -1 by their bit in "signs", and a constant one. */
static void advance_sequence(const double *vertex, int64_t rows, int64_t width, int64_t n, uint64_t signs,
                             const double *v, double *new)
{
    memset(new, 0, (size_t)width * sizeof *new);
    for (int64_t j = 0; j < rows; j++)
        add_column(vertex + width * j, j < n ? v[j] : j == rows - 1 || (signs >> j & 1) ? 1.0 : -1.0, width, new);
}

/* Return the signs of the disturbances that make the successor of v long, chosen greedily channel by channel. */
static uint64_t outward(const double *vertex, int64_t rows, int64_t width, int64_t n, const double *v, double *new)
{
    uint64_t signs = 0;
    memcpy(new, vertex + width * (rows - 1), (size_t)width * sizeof *new);
    for (int64_t j = 0; j < n; j++) add_column(vertex + width * j, v[j], width, new);
    for (int64_t j = n; j < rows - 1; j++) {
        double along = 0.0;
        for (int64_t i = 0; i < width; i++) along += new[i] * vertex[width * j + i];
        if (along >= 0.0) signs |= UINT64_C(1) << j;
        add_column(vertex + width * j, along >= 0.0 ? 1.0 : -1.0, width, new);
    }
    return signs;
}

/* Simulate the sequences first ... end - 1 and update the largest levels |v|^2, "worst" (4, 2) by kind and start.
 *
 * The kind is the number of the sequence mod 4: vertex and signs are drawn in every step (0), once (1), at random times
 * (2), or the vertex at random times and the signs greedily (3; in some the vertex as well). A sequence starts from
 * "begin" (width) or from a random point on the boundary, |v| = 1. columns (vertices, rows, width). */
void hsv_sample_sequences(int64_t vertices, int64_t rows, int64_t width, const double *columns, int64_t n,
                          const double *begin, int64_t first, int64_t end, int64_t steps, uint64_t seed, double *worst)
{
    double v[MAX_WIDTH], new[MAX_WIDTH];
    for (int64_t sequence = first; sequence < end; sequence++) {
        uint64_t state = mix(seed * GOLDEN + (uint64_t)(sequence + 1) * UINT64_C(0xD1342543DE82EF95)), signs = 0;
        const int64_t kind = sequence % 4, boundary = sequence / 4 % 2;
        const int greedy = kind == 3 && sequence % 100 == 3;
        int64_t vertex = 0, left = 0;
        if (boundary) {
            memset(v, 0, sizeof v);
            for (int64_t i = 0; i < n; i++)
                for (int j = 0; j < 4; j++) { /* the sum of four uniform numbers is nearly normal */
                    state += GOLDEN;
                    v[i] += (double)(mix(state) >> 11) * 0x1p-53 - 0.5;
                }
            const double norm = root(square(v, width));
            for (int64_t i = 0; i < width; i++) v[i] /= norm;
        } else
            memcpy(v, begin, (size_t)width * sizeof *v);
        double reached = boundary ? 0.0 : square(v, width);
        for (int64_t k = 0; k < steps; k++) {
            if (left == 0) {
                state += GOLDEN;
                const uint64_t bits = mix(state);
                vertex = (int64_t)((bits >> 40) % (uint64_t)vertices);
                signs = bits << n;
                left = kind == 0 ? 1 : steps;
                if (kind > 1) {
                    state += GOLDEN;
                    left = (int64_t)(1 + mix(state) % 200);
                }
            }
            left--;
            if (greedy) {
                double top = -1.0;
                for (int64_t i = 0; i < vertices; i++) {
                    const uint64_t choice = outward(columns + rows * width * i, rows, width, n, v, new);
                    const double level = square(new, width);
                    if (level > top) top = level, vertex = i, signs = choice;
                }
            } else if (kind == 3)
                signs = outward(columns + rows * width * vertex, rows, width, n, v, new);
            advance_sequence(columns + rows * width * vertex, rows, width, n, signs, v, new);
            memcpy(v, new, sizeof v);
            reached = maximum(reached, square(v, width));
        }
        worst[2 * kind + boundary] = maximum(worst[2 * kind + boundary], reached);
    }
}
