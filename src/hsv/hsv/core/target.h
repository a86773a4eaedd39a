/* BEGIN_TARGET and END_TARGET enclose functions that are compiled for the named instruction sets. */
#pragma once
#include <immintrin.h>
#define PRAGMA(...) _Pragma(#__VA_ARGS__)
#ifdef __clang__
#define BEGIN_TARGET(name) PRAGMA(clang attribute push(__attribute__((target(name))), apply_to = function))
#define END_TARGET PRAGMA(clang attribute pop)
#else
#define BEGIN_TARGET(name) PRAGMA(GCC target(name))
#define END_TARGET
#endif
