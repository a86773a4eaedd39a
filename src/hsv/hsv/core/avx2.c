/* Four flights at a time, one in each lane of a register. */
#ifdef __x86_64__
#pragma GCC target("avx2")
#define LANES 4
#define NAME avx2
#include "instance.h"
#endif
