/* Eight flights at a time, one in each lane of a register. */
#ifdef __x86_64__
#pragma GCC target("avx512f,avx512dq,avx512vl")
#define LANES 8
#define NAME avx512
#include "instance.h"
#endif
