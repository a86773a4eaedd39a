/* One flight, with the instructions of AVX2. */
#ifdef __x86_64__
#pragma GCC target("avx2")
#include "loop.h"

int64_t hsv_fly_1_avx2(hsv_flight *const *flights, void *memory, int64_t start, int64_t stop)
{
    return fly(flights, memory, start, stop);
}
#endif
