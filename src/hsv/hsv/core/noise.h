/* Random numbers as functions of seed, step, stream and draw.
 *
 * The generator is Philox4x64-10 (Salmon, Moraes, Dror and Shaw 2011): a block of four words is a function of the
 * counter (step, stream, draw, 0) and the key (seed, 0), without a state. The numbers of a step therefore do not depend
 * on the order in which steps, blocks and flights are computed. The sequence of numpy's Philox(counter=c, key=k)
 * begins with the block of the counter c + 1. Normal numbers are computed by the method of Box and Muller (1958).
 *
 * Each stream belongs to one channel of one block of the loop, so that another block does not change its numbers. */
#pragma once
#include "elementary.h"

/* Return the high word of the product of two 64-bit words. */
static inline uint64_t high_product(uint64_t a, uint64_t b) { return (uint64_t)((unsigned __int128)a * b >> 64); }

void hsv_philox(const uint64_t *counter, const uint64_t *key, uint64_t *words)
{
    uint64_t a = counter[0], b = counter[1], c = counter[2], d = counter[3], key_0 = key[0], key_1 = key[1];
    for (int round = 0; round < 10; round++) {
        const uint64_t first = UINT64_C(0xD2E7470EE14C6C93), second = UINT64_C(0xCA5A826395121157);
        const uint64_t high_0 = high_product(first, a), low_0 = first * a;
        const uint64_t high_1 = high_product(second, c), low_1 = second * c;
        a = high_1 ^ b ^ key_0, b = low_1, c = high_0 ^ d ^ key_1, d = low_0;
        key_0 += UINT64_C(0x9E3779B97F4A7C15), key_1 += UINT64_C(0xBB67AE8584CAA73B);
    }
    words[0] = a, words[1] = b, words[2] = c, words[3] = d;
}

/* Write two independent numbers, uniform on the multiples of 2^-53 in [0, 1). */
void hsv_uniforms(int64_t seed, int64_t step, int64_t stream, int64_t draw, double *pair)
{
    const uint64_t counter[4] = {(uint64_t)step, (uint64_t)stream, (uint64_t)draw, 0}, key[2] = {(uint64_t)seed, 0};
    uint64_t words[4];
    hsv_philox(counter, key, words);
    pair[0] = (double)(words[0] >> 11) * 0x1p-53;
    pair[1] = (double)(words[1] >> 11) * 0x1p-53;
}

/* Write two independent standard normal numbers, at most 8.6 in magnitude, for each of at most 9 streams. Each stage is
 * computed for all streams, so that the processor overlaps the independent numbers. */
static inline void normals(int64_t seed, int64_t step, const int64_t *streams, int64_t draw, int count,
                           double (*pairs)[2])
{
    double uniform[STATES][2], radius[STATES];
    for (int i = 0; i < count; i++) hsv_uniforms(seed, step, streams[i], draw, uniform[i]);
    /* The argument of the logarithm lies in (0, 1]. */
    for (int i = 0; i < count; i++) radius[i] = __builtin_sqrt(-2.0 * hsv_logarithm(uniform[i][0] + 0x1p-53));
    for (int i = 0; i < count; i++) {
        double sine, cosine;
        sine_cosine(6.283185307179586 * uniform[i][1], &sine, &cosine);
        pairs[i][0] = radius[i] * cosine;
        pairs[i][1] = radius[i] * sine;
    }
}

/* Write two independent standard normal numbers of one stream. */
void hsv_normals(int64_t seed, int64_t step, int64_t stream, int64_t draw, double *pair)
{
    normals(seed, step, &stream, draw, 1, (double (*)[2])pair);
}

static inline double first_uniform(int64_t seed, int64_t step, int64_t stream, int64_t draw)
{
    double pair[2];
    hsv_uniforms(seed, step, stream, draw, pair);
    return pair[0];
}

static inline double first_normal(int64_t seed, int64_t step, int64_t stream, int64_t draw)
{
    double pair[2];
    hsv_normals(seed, step, stream, draw, pair);
    return pair[0];
}
