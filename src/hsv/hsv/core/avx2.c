/* Four flights at a time, one in each lane of an AVX2 register. */
#ifdef __x86_64__
#include "target.h"
BEGIN_TARGET("avx2")
#define LANES 4
#define NAME avx2
#include "instance.h"
END_TARGET
#endif
