/* Which instance of the loop flies: as many flights at a time as the widest registers of this processor hold. */
#include "core.h"

typedef int64_t Fly(hsv_flight *const *flights, void *memory, int64_t start, int64_t stop);
extern Fly hsv_fly_1;
extern const int64_t hsv_memory_1;
#ifdef __x86_64__
extern Fly hsv_fly_4, hsv_fly_8;
extern const int64_t hsv_memory_4, hsv_memory_8;
#endif

int hsv_lanes(void)
{
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
        return 8;
    return __builtin_cpu_supports("avx2") ? 4 : 1;
#else
    return 1;
#endif
}

/* Bytes that hsv_fly needs between the pieces of a group of flights. */
int64_t hsv_memory_size(int lanes)
{
#ifdef __x86_64__
    if (lanes == 8)
        return hsv_memory_8;
    if (lanes == 4)
        return hsv_memory_4;
#endif
    return lanes == 1 ? hsv_memory_1 : -1;
}

int64_t hsv_fly(int lanes, hsv_flight *const *flights, void *memory, int64_t start, int64_t stop)
{
#ifdef __x86_64__
    if (lanes == 8)
        return hsv_fly_8(flights, memory, start, stop);
    if (lanes == 4)
        return hsv_fly_4(flights, memory, start, stop);
#endif
    return hsv_fly_1(flights, memory, start, stop);
}
