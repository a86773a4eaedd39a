/* 8 flights at a time, one in each lane of a register. */
#ifdef __x86_64__
#pragma GCC target("avx512f,avx512dq,avx512vl")
#define LANES 8
#include "loop.h"

int64_t hsv_fly_8(hsv_flight *const *flights, void *memory, int64_t start, int64_t stop)
{
    return fly(flights, memory, start, stop);
}
const int64_t hsv_memory_8 = sizeof(Loop);
#endif
