/* 4 flights at a time, one in each lane of a register. */
#ifdef __x86_64__
#pragma GCC target("avx2")
#define LANES 4
#include "loop.h"

int64_t hsv_fly_4(hsv_flight *const *flights, void *memory, int64_t start, int64_t stop)
{
    return fly(flights, memory, start, stop);
}
const int64_t hsv_memory_4 = sizeof(Loop);
#endif
