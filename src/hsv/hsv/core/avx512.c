/* Eight flights at a time, one in each lane of an AVX-512 register. */
#ifdef __x86_64__
#include "target.h"
BEGIN_TARGET("avx512f,avx512dq,avx512vl")
#define LANES 8
#define NAME avx512
#include "instance.h"
END_TARGET
#endif
