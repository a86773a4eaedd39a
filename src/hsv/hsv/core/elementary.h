/* Elementary functions with the same bits on every processor.
 *
 * The functions of libm differ between machines in the last bit. The error of the functions here is at most one unit in
 * the last place in the stated ranges; outside these ranges the result is NaN.
 *
 * sine_cosine and exponential accept the complex arguments of the complex step, whose imaginary part has a negligible
 * square. sine_cosine, exponential and arctangent2 accept vectors of lanes.
 *
 * Sources: argument reduction by Cody and Waite; rounding errors by Dekker (1971) and Knuth; power series. */
#pragma once
#include "real.h"

/* Largest magnitudes of arguments: of sine, cosine and tangent (rad); of the exponential; of the arctangent, whose
 * smallest non-zero magnitude is the inverse. */
static const double ANGLE_RANGE = 1e5, EXPONENT_RANGE = 700.0, RATIO_RANGE = 1e140;
/* The first 33 bits of pi / 2, the next 33 bits, the remainder; pi / 2, pi / 4 and log 2 as sums of two numbers. */
static const double HALF_PI_1 = 1.5707963267341256, HALF_PI_2 = 6.077100506303966e-11,
                    HALF_PI_3 = 2.0222662487959506e-21;
static const double HALF_PI_HIGH = 1.5707963267948966, HALF_PI_LOW = 6.123233995736766e-17;
static const double QUARTER_PI_HIGH = 0.7853981633974483, QUARTER_PI_LOW = 3.061616997868383e-17;
static const double LOG_2_HIGH = 0.6931471803691238, LOG_2_LOW = 1.9082149292705877e-10;
static const double TWO_OVER_PI = 0.6366197723675814, LOG_2_INVERSE = 1.4426950408889634, ROOT_2 = 1.4142135623730951;
static const double TAN_PI_8 = 0.41421356237309503, TAN_3_PI_8 = 2.414213562373095;
/* Adding and subtracting TO_INTEGER rounds to the nearest integer; SPLIT splits a number into two of 26 bits. */
static const double TO_INTEGER = 0x1.8p52, SPLIT = 0x1.0000002p27;

/* Return sin y - y for |y| <= pi / 4; the series is summed in pairs. */
static inline plain sine_rest(plain y)
{
    const plain z = y * y, w = z * z, v = w * w;
    const plain series = ((-1.0 / 6.0 + z * (1.0 / 120.0)) + w * (-1.0 / 5040.0 + z * (1.0 / 362880.0))) +
                         v * ((-1.0 / 39916800.0 + z * (1.0 / 6227020800.0)) +
                              w * (-1.0 / 1307674368000.0 + z * (1.0 / 355687428096000.0)));
    return z * y * series;
}

/* Split cos y for |y| <= pi / 4 into the rounded 1 - y^2 / 2 and the remainder. */
static inline void cosine_terms(plain y, plain *high, plain *low)
{
    const plain z = y * y, w = z * z, v = w * w;
    const plain series = ((1.0 / 24.0 + z * (-1.0 / 720.0)) + w * (1.0 / 40320.0 + z * (-1.0 / 3628800.0))) +
                         v * ((1.0 / 479001600.0 + z * (-1.0 / 87178291200.0)) +
                              w * (1.0 / 20922789888000.0 + z * (-1.0 / 6402373705728000.0)));
    const plain half = 0.5 * z;
    *high = 1.0 - half;
    *low = ((1.0 - *high) - half) + w * series;
}

/* Split a + b into its rounded value and the rounding error. */
static inline void two_sum(plain a, plain b, plain *total, plain *rest)
{
    const plain sum = a + b, shadow = sum - a;
    *total = sum;
    *rest = (a - (sum - shadow)) + (b - shadow);
}

/* Return the rounding error of a b. */
static inline plain product_error(plain a, plain b)
{
    plain scaled = SPLIT * a;
    const plain a_high = scaled - (scaled - a), a_low = a - a_high;
    scaled = SPLIT * b;
    const plain b_high = scaled - (scaled - b), b_low = b - b_high;
    return ((a_high * b_high - a * b) + a_high * b_low + a_low * b_high) + a_low * b_low;
}

/* Split (high + low) / (by_high + by_low) into its rounded value and the remainder. */
static inline void quotient(plain high, plain low, plain by_high, plain by_low, plain *q, plain *rest)
{
    *q = high / by_high;
    const plain product = *q * by_high, error = product_error(*q, by_high);
    *rest = (((high - product) - error) + low - *q * by_low) / by_high;
}

/* 1 / (2k + 1) for the power series of arctangent and logarithm. */
static const double ODD_INVERSE[] = {1.0 / 1.0,  1.0 / 3.0,  1.0 / 5.0,  1.0 / 7.0,  1.0 / 9.0,  1.0 / 11.0,
                                     1.0 / 13.0, 1.0 / 15.0, 1.0 / 17.0, 1.0 / 19.0, 1.0 / 21.0, 1.0 / 23.0,
                                     1.0 / 25.0, 1.0 / 27.0, 1.0 / 29.0, 1.0 / 31.0, 1.0 / 33.0, 1.0 / 35.0,
                                     1.0 / 37.0, 1.0 / 39.0, 1.0 / 41.0, 1.0 / 43.0, 1.0 / 45.0};

/* Return arctan(high + low) - high for |high| <= tan(pi / 8), by the power series. */
static inline plain arctangent_rest(plain high, plain low)
{
    const plain z = high * high;
    plain series = all(0.0);
    for (int k = 22; k >= 1; k--) series = series * z + (k % 2 ? -ODD_INVERSE[k] : ODD_INVERSE[k]);
    return high * z * series + low / (1.0 + z);
}

#ifdef BASE
/* Write sin x and cos x for |x| <= 1e5 as sums of two numbers each. */
static inline void turned_terms(double x, double *s, double *s_low, double *c, double *c_low)
{
    const double n = (x * TWO_OVER_PI + TO_INTEGER) - TO_INTEGER;
    double high, low, cosine, cosine_low;
    two_sum(x - n * HALF_PI_1, -n * HALF_PI_2, &high, &low);
    low -= n * HALF_PI_3;
    const double y = high + low, rest = (high - y) + low;
    const int turns = (int)n;
    cosine_terms(y, &cosine, &cosine_low);
    const double error = product_error(y, y), sine_low = sine_rest(y);
    const double first[2] = {y, sine_low + (rest * (cosine + cosine_low) + -1.0 / 6.0 * y * error)};
    const double second[2] = {cosine, cosine_low - (rest * (y + sine_low) + 0.5 * error)};
    const double sign_s = turns & 2 ? -1.0 : 1.0, sign_c = (turns & 1) == (turns >> 1 & 1) ? 1.0 : -1.0;
    const double *sine = turns & 1 ? second : first, *other = turns & 1 ? first : second;
    *s = sign_s * sine[0], *s_low = sign_s * sine[1];
    *c = sign_c * other[0], *c_low = sign_c * other[1];
}

void hsv_any_sine_cosine(double x, double *sine, double *cosine)
{
    if (!(__builtin_fabs(x) <= ANGLE_RANGE)) {
        *sine = *cosine = NAN;
        return;
    }
    double s, s_low, c, c_low;
    if (__builtin_fabs(x) <= QUARTER_PI_HIGH) {
        s = x, s_low = sine_rest(x);
        cosine_terms(x, &c, &c_low);
    } else
        turned_terms(x, &s, &s_low, &c, &c_low);
    *sine = s + s_low;
    *cosine = c + c_low;
}

/* Return tan x for |x| <= 1e5. */
double hsv_tangent(double x)
{
    if (!(__builtin_fabs(x) <= ANGLE_RANGE)) return NAN;
    double s, s_low, c, c_low, high, low;
    turned_terms(x, &s, &s_low, &c, &c_low);
    two_sum(s, s_low, &s, &s_low);
    two_sum(c, c_low, &c, &c_low);
    quotient(s, s_low, c, c_low, &high, &low);
    return high + low;
}

/* Return the angle from -pi / 2 to pi / 2 with the sine x, |x| <= 1. */
double hsv_arcsine(double x)
{
    /* coefficients (2k)! / (4^k k!^2 (2k + 1)) of x^(2k + 1), k = 1 ... 25 */
    static const double series[] = {0.16666666666666666,   0.075,
                                    0.044642857142857144,  0.030381944444444444,
                                    0.022372159090909092,  0.017352764423076924,
                                    0.01396484375,         0.011551800896139705,
                                    0.009761609529194078,  0.008390335809616815,
                                    0.0073125258735988454, 0.006447210311889649,
                                    0.005740037670841924,  0.005153309682319905,
                                    0.004660143486915096,  0.004240907093679363,
                                    0.003880964558837669,  0.0035692053938259347,
                                    0.003297059503473485,  0.0030578216492580306,
                                    0.002846178401108942,  0.00265787063820729,
                                    0.0024894486782468836, 0.002338091892111975,
                                    0.0022014739737101384};
    const double a = __builtin_fabs(x);
    if (!(a <= 1.0)) return NAN;
    /* arcsin a = pi / 2 - 2 arcsin r with r^2 = (1 - a) / 2. */
    const double z = a <= 0.5 ? a * a : 0.5 * (1.0 - a);
    double sum = 0.0, angle;
    for (int k = 24; k >= 0; k--) sum = sum * z + series[k];
    if (a <= 0.5)
        angle = a + a * z * sum;
    else {
        const double r = __builtin_sqrt(z), product = r * r;
        /* rounding error of the root */
        double rest = r > 0.0 ? ((z - product) - product_error(r, r)) / (2.0 * r) : 0.0;
        rest += r * z * sum;
        double high, low;
        two_sum(HALF_PI_HIGH, -2.0 * r, &high, &low);
        angle = high + (low + (HALF_PI_LOW - 2.0 * rest));
    }
    return x < 0.0 ? -angle : angle;
}

/* Return the angle from -pi to pi of the point (x, y). The angle of (0, 0) is 0; the sign of a zero is ignored. */
double hsv_arctangent2(double y, double x)
{
    const double a = __builtin_fabs(y), b = __builtin_fabs(x);
    if (!(a == 0.0 || (1.0 / RATIO_RANGE <= a && a <= RATIO_RANGE)) ||
        !(b == 0.0 || (1.0 / RATIO_RANGE <= b && b <= RATIO_RANGE)))
        return NAN;
    if (a == 0.0) return x >= 0.0 ? 0.0 : 2.0 * HALF_PI_HIGH;
    /* The angle of (b, a) is a multiple of pi / 4 plus an angle of at most pi / 8. */
    double base, base_low, high, low;
    if (a <= TAN_PI_8 * b) {
        base = base_low = 0.0;
        quotient(a, 0.0, b, 0.0, &high, &low);
    } else if (a < TAN_3_PI_8 * b) {
        double difference, difference_low, total, total_low;
        base = QUARTER_PI_HIGH, base_low = QUARTER_PI_LOW;
        two_sum(a, -b, &difference, &difference_low);
        two_sum(a, b, &total, &total_low);
        quotient(difference, difference_low, total, total_low, &high, &low);
    } else {
        base = HALF_PI_HIGH, base_low = HALF_PI_LOW;
        quotient(-b, 0.0, a, 0.0, &high, &low);
    }
    low = arctangent_rest(high, low);
    if (x < 0.0) {
        base = 2.0 * HALF_PI_HIGH - base, base_low = 2.0 * HALF_PI_LOW - base_low;
        high = -high, low = -low;
    }
    double total, rest;
    two_sum(base, high, &total, &rest);
    const double angle = total + (rest + (low + base_low));
    return y < 0.0 ? -angle : angle;
}

/* Return the natural logarithm of a normal positive number. */
double hsv_logarithm(double x)
{
    if (!(DBL_MIN <= x && x <= DBL_MAX)) return NAN;
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    int exponent = (int)(bits >> 52) - 1023;
    /* Scale by two factors, because 2^-1023 is not a normal number. */
    const int half = (exponent - (exponent & 1)) / 2;
    double mantissa = x * power_of_two(-half) * power_of_two(half - exponent);
    if (mantissa > ROOT_2) {
        mantissa *= 0.5;
        exponent++;
    }
    /* log m = 2 artanh s = f - s (f - 2 s^2 (1/3 + s^2/5 + ...)) with f = m - 1, exact, and s = f / (2 + f). */
    const double f = mantissa - 1.0, s = f / (2.0 + f), z = s * s, half_square = 0.5 * f * f;
    double series = 0.0;
    for (int k = 12; k >= 1; k--) series = series * z + ODD_INVERSE[k];
    const double correction = s * (half_square + 2.0 * z * series), count = exponent;
    return count * LOG_2_HIGH - ((half_square - (correction + count * LOG_2_LOW)) - f);
}
#endif

static inline void sine_cosine(real x, real *sine, real *cosine)
{
    const plain a = real_part(x);
    plain s, c, c_low;
    if (every(magnitude(a) <= QUARTER_PI_HIGH)) {
        s = a + sine_rest(a);
        cosine_terms(a, &c, &c_low);
        c = c + c_low;
    } else
        for (int i = 0; i < LANES; i++) {
            double own_s, own_c;
            hsv_any_sine_cosine(lane(a, i), &own_s, &own_c);
            lane(s, i) = own_s, lane(c, i) = own_c;
        }
    const real step = x - a; /* zero for real x */
    *sine = s + c * step;
    *cosine = c - s * step;
}

#ifndef COMPLEX
static inline real arctangent2(real y, real x)
{
    const real a = magnitude(y);
    /* The usual case: a small non-zero angle between the inertial and the air-relative path. */
    if (every((a <= TAN_PI_8 * x) & (a >= 1.0 / RATIO_RANGE) & (x <= RATIO_RANGE))) {
        real high, low, total, rest;
        quotient(a, all(0.0), x, all(0.0), &high, &low);
        low = arctangent_rest(high, low);
        two_sum(all(0.0), high, &total, &rest);
        const real angle = total + (rest + (low + 0.0));
        return choose(y < 0.0, -angle, angle);
    }
    real angle = a;
    for (int i = 0; i < LANES; i++) lane(angle, i) = hsv_arctangent2(lane(y, i), lane(x, i));
    return angle;
}
#endif

static inline plain plain_exponential(plain x)
{
    const plain n = (x * LOG_2_INVERSE + TO_INTEGER) - TO_INTEGER;
    const plain high = x - n * LOG_2_HIGH, low = n * LOG_2_LOW;
    const plain r = high - low, rest = (high - r) - low;
    const plain z = r * r, w = z * z, v = w * w;
    plain series = ((1.0 / 2.0 + r * (1.0 / 6.0)) + z * (1.0 / 24.0 + r * (1.0 / 120.0))) +
                   w * ((1.0 / 720.0 + r * (1.0 / 5040.0)) + z * (1.0 / 40320.0 + r * (1.0 / 362880.0)));
    series += v * ((1.0 / 3628800.0 + r * (1.0 / 39916800.0)) + z * (1.0 / 479001600.0 + r * (1.0 / 6227020800.0)));
    return (1.0 + (r + (z * series + rest))) * power_of_two(n);
}

static inline real exponential(real x)
{
    const plain a = real_part(x);
    const mask inside = magnitude(a) <= EXPONENT_RANGE;
    const plain value =
        every(inside) ? plain_exponential(a) : choose(inside, plain_exponential(choose(inside, a, all(0.0))), all(NAN));
    return value * (1.0 + (x - a)); /* the last factor is one for real x */
}
