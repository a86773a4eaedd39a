/* One flight, with the instructions of AVX2. */
#ifdef __x86_64__
#pragma GCC target("avx2")
#define LANES 1
#define NAME avx2_single
#include "instance.h"
#endif
