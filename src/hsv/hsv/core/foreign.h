/* Calls of the step functions of others (hsv_block.h), and protection of a flight from what such code may change: the
 * rounding mode of the thread, and numbers behind the arrays that it writes to. */
#pragma once
#include "core.h"

#include <string.h>

/* Round to nearest, keep subnormal numbers, raise no traps: the arithmetic of every flight. Loading a library that was
 * linked with -ffast-math, or a step function, may have changed it. */
static inline void default_arithmetic(void)
{
#if defined(__SSE2__)
    __builtin_ia32_ldmxcsr(0x1f80);
#elif defined(__aarch64__)
    __asm__ volatile("msr fpcr, %0" : : "r"(UINT64_C(0)) : "memory");
#endif
}

/* Write guard words behind an array of numbers; intact finds out whether they were overwritten. */
static inline void set_guards(double *behind)
{
    const uint64_t word = UINT64_C(0x7ff4a5a5a5a5a5a5);
    for (int i = 0; i < GUARDS; i++) memcpy(behind + i, &word, sizeof word);
}

static inline int intact(const double *behind)
{
    double guards[GUARDS];
    set_guards(guards);
    return memcmp(behind, guards, sizeof guards) == 0;
}

/* Call a step function and write its first "count" outputs to "out"; outputs that it does not set are NaN. Return its
 * result, or OVERRUN if it wrote behind its outputs. Not inlined: no arithmetic may move to before the restoration. */
static __attribute__((noinline, unused)) int32_t call_step(const hsv_call *call, int64_t k, const double *in,
                                                           double *out, int count)
{
    double own[INPUTS + 1 + GUARDS];
    for (int i = 0; i < count; i++) own[i] = __builtin_nan("");
    set_guards(own + count);
    const int32_t result = call->function(k, in, own, call->state, call->par);
    default_arithmetic();
    memcpy(out, own, (size_t)count * sizeof *out);
    return intact(own + count) ? result : OVERRUN;
}
