/* Selection of an instance of the loop by instruction set and number of flights. */
#include "foreign.h"

typedef int64_t Fly(hsv_flight *const *flights, void *memory, int64_t start, int64_t stop, int halves);
extern Fly hsv_fly_single;
extern const int64_t hsv_memory_single;
#ifdef __x86_64__
extern Fly hsv_fly_avx2_single, hsv_fly_avx2, hsv_fly_avx512;
extern const int64_t hsv_memory_avx2, hsv_memory_avx512;
#endif

/* Return the widest instruction set that this processor has and the core uses. */
int hsv_widest(void)
{
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
        return AVX512;
    if (__builtin_cpu_supports("avx2")) return AVX2;
#endif
    return SSE2;
}

/* Return the size (bytes) of the memory that hsv_fly keeps between calls, for 1, 4 or 8 flights. */
int64_t hsv_memory_size(int64_t flights)
{
#ifdef __x86_64__
    if (flights > 1) return flights == 8 ? hsv_memory_avx512 : hsv_memory_avx2;
#endif
    return flights > 0 ? hsv_memory_single : 0;
}

/* See "fly" in loop.h; return "start" if there is no instance for the instruction set and number of flights. */
int64_t hsv_fly(int instructions, int64_t count, hsv_flight *const *flights, void *memory, int64_t start, int64_t stop,
                int halves)
{
    Fly *fly = count == 1 ? hsv_fly_single : 0;
#ifdef __x86_64__
    if (instructions >= AVX2) fly = count == 1 ? hsv_fly_avx2_single : count == 4 ? hsv_fly_avx2 : 0;
    if (instructions >= AVX512 && count == 8) fly = hsv_fly_avx512;
#endif
    default_arithmetic();
    return fly && instructions >= SSE2 ? fly(flights, memory, start, stop, halves) : start;
}
