/* The type "real" of the numbers in the core.
 *
 * Each formula is written once, for the type "real". It is compiled with
 *
 *   double             for a single flight, for the nodes and for the exported controller,
 *   a vector register  of 4 (AVX2) or 8 (AVX-512) doubles for campaigns, one flight in each lane (LANES > 1),
 *   double _Complex    for derivatives by the complex step (COMPLEX).
 *
 * "plain" is the type of the real part of a "real"; it can be compared. A "mask" is the result of a comparison. Vector
 * types have no ?:, && and ! in C; choose, & and opposite replace them. every and any reduce a mask to a truth value.
 *
 * Results are the same to the bit on every processor: the core uses only additions, subtractions, multiplications,
 * divisions and square roots of IEEE 754, in the order written, without fused operations (-ffp-contract=off). */
#pragma once
#include "core.h"

#include <float.h>
#include <math.h>
#include <string.h>
#if defined(__FAST_MATH__) || FLT_EVAL_METHOD != 0
#error "expected IEEE-754 arithmetic in double precision: no -ffast-math, no x87"
#endif
#ifndef LANES
#define LANES 1
#endif

#if LANES == 1
typedef double plain;
typedef int mask;
#ifdef COMPLEX
typedef double _Complex real;
static inline plain real_part(real x) { return __real__ x; }
#else
typedef double real;
static inline plain real_part(real x) { return x; }
#endif
static inline plain all(double x) { return x; }
static inline plain choose(mask m, plain a, plain b) { return m ? a : b; }
static inline real select_real(mask m, real a, real b) { return m ? a : b; }
static inline mask opposite(mask m) { return !m; }
static inline int every(mask m) { return m; }
static inline int any(mask m) { return m; }
static inline double least_lane(plain x) { return x; }
static inline double greatest_lane(plain x) { return x; }
static inline plain magnitude(plain x) { return fabs(x); }
static inline plain root(plain x) { return sqrt(x); }
#define lane(x, i) (*((void)(i), &(x)))

/* Return 2^n for an integer-valued n from -1022 to 1023. The last bits of n + 1.5 2^52 are the integer n. */
static inline plain power_of_two(plain n)
{
    const plain shifted = n + 0x1.8p52;
    uint64_t bits;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (bits << 52) + (UINT64_C(1023) << 52);
    plain power;
    memcpy(&power, &bits, sizeof power);
    return power;
}

#else
typedef double real __attribute__((vector_size(8 * LANES)));
typedef int64_t mask __attribute__((vector_size(8 * LANES)));
typedef uint64_t word __attribute__((vector_size(8 * LANES)));
typedef real plain;
static inline real real_part(real x) { return x; }
/* Return x in all lanes; adding x to zeros instead of subtracting zeros would turn -0.0 into 0.0. */
static inline real all(double x) { return x - (real){0.0}; }
static inline real choose(mask m, real a, real b) { return (real)((m & (mask)a) | (~m & (mask)b)); }
static inline real select_real(mask m, real a, real b) { return choose(m, a, b); }
static inline mask opposite(mask m) { return ~m; }
static inline real magnitude(real x) { return (real)((mask)x & INT64_MAX); }
static inline real power_of_two(real n) { return (real)(((word)(n + 0x1.8p52) << 52) + (UINT64_C(1023) << 52)); }
#define lane(x, i) ((x)[i])
#if LANES == 8
static inline int lane_bits(mask m) { return _mm512_test_epi64_mask((__m512i)m, (__m512i)m); }
static inline real root(real x) { return (real)_mm512_sqrt_pd((__m512d)x); }
#else
static inline int lane_bits(mask m) { return _mm256_movemask_pd((__m256d)m); }
static inline real root(real x) { return (real)_mm256_sqrt_pd((__m256d)x); }
#endif
static inline int every(mask m) { return lane_bits(m) == (1 << LANES) - 1; }
static inline int any(mask m) { return lane_bits(m) != 0; }
static inline double least_lane(real x)
{
    double found = x[0];
    for (int i = 1; i < LANES; i++) found = x[i] < found ? x[i] : found;
    return found;
}
static inline double greatest_lane(real x)
{
    double found = x[0];
    for (int i = 1; i < LANES; i++) found = x[i] > found ? x[i] : found;
    return found;
}
#endif

static inline mask is_finite(plain x) { return x - x == 0.0; }
static inline mask never(void) { return (mask){0}; }
/* If the first argument is NaN, it is returned. */
static inline plain minimum(plain a, plain b) { return choose(b < a, b, a); }
static inline plain maximum(plain a, plain b) { return choose(b > a, b, a); }
static inline plain limited(plain x, double low, double high)
{
    const plain above = choose(low > x, all(low), x);
    return choose(high < above, all(high), above);
}
