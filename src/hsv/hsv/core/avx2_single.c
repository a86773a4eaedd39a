/* One flight with AVX2 instructions. */
#ifdef __x86_64__
#include "target.h"
BEGIN_TARGET("avx2")
#define LANES 1
#define NAME avx2_single
#include "instance.h"
END_TARGET
#endif
