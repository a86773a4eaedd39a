/* Disturbances of the air: wind, shear, turbulence, gusts and variation of the density.
 *
 * Dryden turbulence (MIL-F-8785C, MIL-HDBK-1797) is white noise of unit density through
 *
 *   H_u(s) = sigma_u sqrt(2 tau_u) / (1 + tau_u s),
 *   H_w(s) = sigma_w sqrt(tau_w) (1 + sqrt(3) tau_w s) / (1 + tau_w s)^2,   tau = L / V,
 *
 * with the scale length L and the velocity V. Both filters are discretised exactly over the distance flown in a period
 * and are stationary from the first step. The density varies as a Gauss-Markov process along the path. A gust has the
 * (1 - cos) shape of MIL-F-8785C and CS-25.341; its mean over a period is computed in closed form. */
#pragma once
#include "noise.h"
#include "vehicle.h"

/* Memory: turbulence along the path, the two states of the turbulence across the path and the variation of the density,
 * each in units of its sigma; then the distance (m) flown in each gust. */
enum { ALONG, ACROSS_1, ACROSS_2, VARIATION, DISTANCE };

/* Write, for H_w over the distance r L, the transition F (2, 2) of its states and the three entries of the lower
 * Cholesky factor of I - F F'. The states are standard normal and uncorrelated;
 * w = sigma / 2 (first + sqrt(3) second). */
void hsv_dryden_cross_map(double r, double *map)
{
    const double decay = exponential(-r), square = decay * decay;
    const double first = root(maximum(1.0 - square * (1.0 + 2.0 * r + 2.0 * r * r), 0.0));
    const double across = 2.0 * square * r * r, lower = first > 0.0 ? across / first : 0.0;
    map[0] = decay * (1.0 + r), map[1] = decay * r, map[2] = -decay * r, map[3] = decay * (1.0 - r);
    map[4] = first, map[5] = lower;
    map[6] = root(maximum(1.0 - square * (1.0 - 2.0 * r + 2.0 * r * r) - lower * lower, 0.0));
}

/* Return the integral from 0 to x (m) of a gust of unit amplitude, (1 - cos(pi x / length)) / 2. It ends after two
 * lengths, or stays at its maximum after one. */
static double gust_integral(double x, double length, int64_t stays)
{
    const double pi = 3.141592653589793, end = stays ? length : 2.0 * length, inside = limited(x, 0.0, end);
    double sine, cosine;
    sine_cosine(pi * (inside / length), &sine, &cosine);
    const double area = 0.5 * (inside - length / pi * sine);
    return stays && x > end ? area + (x - end) : area;
}

/* Return the mean velocity of a gust between two distances (m) from its start, relative to its maximum. */
double hsv_gust_mean(double begin, double end, double length, int64_t stays)
{
    return (gust_integral(end, length, stays) - gust_integral(begin, length, stays)) / (end - begin);
}

/* Advance a Gauss-Markov process of unit variance by r correlation lengths; step 0 draws its first value. */
static void advance_markov(double *value, double r, int64_t k, int64_t seed, int64_t stream)
{
    const double drawn = first_normal(seed, k, stream, 0), decay = exponential(-r);
    *value = k == 0 ? drawn : decay * *value + root(maximum(1.0 - decay * decay, 0.0)) * drawn;
}

/* Write the first three conditions for the period after step k, forward and upward wind (m/s) and relative density, at
 * an altitude (m) and a speed (m/s). */
void hsv_atmosphere_step(const hsv_atmosphere *air, double *memory, int64_t k, int64_t seed, double altitude,
                         double speed, double *conditions)
{
    const double way = speed * air->period;
    conditions[WIND_FORWARD] = air->wind[0] + air->shear * (altitude - air->shear_altitude);
    conditions[WIND_UP] = air->wind[1];
    conditions[DENSITY] = 1.0 + air->density_offset;
    if (air->sigma[0] > 0.0) {
        advance_markov(&memory[ALONG], way / air->length[0], k, seed, TURBULENCE_FORWARD);
        conditions[WIND_FORWARD] += air->sigma[0] * memory[ALONG];
    }
    if (air->sigma[1] > 0.0) {
        double drawn[2], F[7];
        hsv_normals(seed, k, TURBULENCE_UP, 0, drawn);
        if (k == 0)
            memory[ACROSS_1] = drawn[0], memory[ACROSS_2] = drawn[1];
        else {
            hsv_dryden_cross_map(way / air->length[1], F);
            const double a = memory[ACROSS_1], b = memory[ACROSS_2];
            memory[ACROSS_1] = F[0] * a + F[1] * b + F[4] * drawn[0];
            memory[ACROSS_2] = F[2] * a + F[3] * b + (F[5] * drawn[0] + F[6] * drawn[1]);
        }
        const double root_3 = 1.7320508075688772;
        conditions[WIND_UP] += 0.5 * air->sigma[1] * (memory[ACROSS_1] + root_3 * memory[ACROSS_2]);
    }
    if (air->density_sigma > 0.0) {
        advance_markov(&memory[VARIATION], way / air->density_length, k, seed, DENSITY_VARIATION);
        conditions[DENSITY] += air->density_sigma * memory[VARIATION];
    }
    for (int64_t i = 0; i < air->gusts; i++)
        if (k >= air->gust_start[i]) {
            double *distance = &memory[DISTANCE + i];
            const double mean =
                hsv_gust_mean(*distance, *distance + way, air->gust_length[i], air->gust_stays[i] != 0.0);
            conditions[WIND_FORWARD] += air->gust[2 * i] * mean;
            conditions[WIND_UP] += air->gust[2 * i + 1] * mean;
            *distance = *distance + way;
        }
}
