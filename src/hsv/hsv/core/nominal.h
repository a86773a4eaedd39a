/* The nominal system: the scheduled polytopic model and the nominal law with nested gains.
 *
 *   [A(p), B(p)] = sum_i w_i(p) [A_i, B_i]                    model at altitude and velocity p (eq. 11, eq. 12)
 *   x_n(k+1) = A(p) x_n(k) + B(p) u_n(k) + d_r(k)             nominal state (eq. 20, eq. 46)
 *   u_n = K_g x_n, g of the smallest ellipsoid with x_n' P_g x_n <= 1         nested gains (eq. 21)
 *
 * The weights w_i are called tau_i in eq. 11; the design provides K_g and P_g = Q^-1 (eq. 32 to eq. 35). d_r is the
 * defect of the reference (hsv.control.reference_trajectory); p is measured and clamped to the envelope. With
 * interpolated gains, u_n is continuous: K = a K_g + (1 - a) K_(g+1) with x_n' (a P_g + (1 - a) P_(g+1)) x_n = 1 (Wan
 * and Kothare, Automatica 39, 2003). */
#pragma once
#include "real.h"

enum { MAX_VERTICES = 64, ENTRIES = STATES * (STATES + INPUTS), MAX_SIZE = 9 * SUMS };

/* Return the level x' P x of the first "size" entries of x in the ellipsoid with P (size, size). */
static inline real level(const double *P, int64_t size, const real *x)
{
    real total = all(0.0);
    for (int64_t i = 0; i < size; i++) {
        real row = all(0.0);
        for (int64_t j = 0; j < size; j++) row += P[size * i + j] * x[j];
        total += x[i] * row;
    }
    return total;
}

static inline real gain_times_state(const double *row, const real *x)
{
    real total = all(0.0);
    for (int j = 0; j < STATES; j++) total += row[j] * x[j];
    return total;
}

/* Write u_n and the index of its gain, 0 for the outermost; return whether x_n lies in any ellipsoid. If it does not,
 * the outermost gain is used. Without gains u_n is zero. */
static inline mask nominal_input(const hsv_nominal *nominal, const real *x_n, real *u_n, real *index)
{
    const int count = (int)nominal->count;
    real held = all(0.0), beyond = all(0.0); /* levels in the smallest ellipsoid with x_n and in the next smaller */
    mask inside = count > 0 ? never() : opposite(never());
    *index = all(0.0);
    for (int g = count - 1; g >= 0; g--) {
        const real value = level(nominal->ellipsoids + RIGID * RIGID * g, RIGID, x_n);
        const mask now = opposite(inside) & (value <= MEMBERSHIP_BOUNDARY);
        *index = choose(now, all(g), *index);
        held = choose(now, value, held);
        inside |= now;
        if (every(inside)) break;
        beyond = choose(inside, beyond, value);
    }
    for (int i = 0; i < INPUTS; i++) u_n[i] = all(0.0);
    const int first = (int)least_lane(*index), last = (int)greatest_lane(*index);
    for (int g = first; g <= last && g < count; g++)
        for (int i = 0; i < INPUTS; i++) {
            const double *K = nominal->gains + STATES * (INPUTS * g + i);
            real total = gain_times_state(K, x_n);
            if (nominal->interpolated && g + 1 < count) {
                const real share = (beyond - MEMBERSHIP_BOUNDARY) / (beyond - held);
                const real inner = gain_times_state(K + STATES * INPUTS, x_n);
                total = choose(inside, inner + share * (total - inner), total);
            }
            u_n[i] = choose(*index == (double)g, total, u_n[i]);
        }
    return inside;
}

static inline int piece_of(const hsv_axis *axis, double value)
{
    int i = 0;
    while (i < axis->pieces - 1 && value >= axis->breakpoints[i + 1]) i++;
    return i;
}

/* Write the weights of the vertices along an axis; return whether p lies between its ends. A NaN gives the weights at
 * the lower end. */
static inline mask axis_weights(const hsv_axis *axis, real p, real *weights)
{
    const double low = axis->breakpoints[0], high = axis->breakpoints[axis->pieces];
    const int64_t count = axis->vertices, power = axis->pieces * count;
    const real value = choose(p > low, choose(p > high, all(high), p), all(low));
    const int first = piece_of(axis, least_lane(value));
    const int last = LANES == 1 ? first : piece_of(axis, greatest_lane(value));
    for (int piece = first; piece <= last; piece++) {
        const mask due = value >= axis->breakpoints[piece];
        const real local = value - axis->breakpoints[piece];
        for (int64_t i = 0; i < count; i++) {
            const double *c = axis->coefficients + piece * count + i;
            const real weight = ((c[0] * local + c[power]) * local + c[2 * power]) * local + c[3 * power];
            weights[i] = piece == first ? weight : choose(due, weight, weights[i]);
        }
    }
    return value == p;
}

/* Write the weights of all vertices, ordered by altitude, then velocity; return whether p is inside the envelope. */
static inline mask vertex_weights(const hsv_polytope *polytope, real altitude, real velocity, real *weights)
{
    real h_weights[MAX_VERTICES], v_weights[MAX_VERTICES];
    const int64_t n_h = polytope->altitude.vertices, n_v = polytope->velocity.vertices;
    const mask h_inside = axis_weights(&polytope->altitude, altitude, h_weights);
    const mask v_inside = axis_weights(&polytope->velocity, velocity, v_weights);
    for (int64_t i = 0; i < n_h; i++)
        for (int64_t j = 0; j < n_v; j++) weights[i * n_v + j] = h_weights[i] * v_weights[j];
    return h_inside & v_inside;
}

/* Write the weighted sum of each entry over the vertices, added in the order of the vertices. */
static inline void weighted_entries(const hsv_polytope *polytope, const real *weights, real *S)
{
    /* SUMS sums at a time fit into the registers and hide the latency of the additions. */
    for (int64_t e = 0; e < polytope->size; e += SUMS) {
        real sums[SUMS];
        for (int i = 0; i < SUMS; i++) sums[i] = all(0.0);
        for (int64_t r = 0; r < polytope->vertices; r++)
            for (int i = 0; i < SUMS; i++) sums[i] += weights[r] * polytope->S[r * polytope->size + e + i];
        for (int i = 0; i < SUMS; i++) S[e + i] = sums[i];
    }
}

/* Advance x_n by one step; return whether altitude and velocity are inside the envelope. */
static inline mask nominal_advance(const hsv_polytope *polytope, real altitude, real velocity, real *x_n,
                                   const real *u_n, const real *d_r)
{
    real weights[MAX_VERTICES], S[MAX_SIZE], new[STATES];
    const mask inside = vertex_weights(polytope, altitude, velocity, weights);
    weighted_entries(polytope, weights, S);
    const int64_t *starts = polytope->starts, *entries = polytope->entries;
    for (int i = 0; i < STATES; i++) {
        const int64_t first = i * (STATES + INPUTS);
        real total = all(0.0);
        for (int64_t e = starts[2 * i]; e < starts[2 * i + 1]; e++) total += S[e] * x_n[entries[e] - first];
        for (int64_t e = starts[2 * i + 1]; e < starts[2 * i + 2]; e++)
            total += S[e] * u_n[entries[e] - first - STATES];
        new[i] = total + d_r[i];
    }
    for (int i = 0; i < STATES; i++) x_n[i] = new[i];
    return inside;
}
