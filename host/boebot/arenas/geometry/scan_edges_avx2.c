/* scan_edges_avx2.c: scan_edges.c once more, with the registers of AVX2: chosen at run time, the same bits. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(WORLD_PLAIN_LANES)

#include <immintrin.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SCAN_AVX2
#define SCAN_KERNELS scan_kernels_avx2
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC target("avx2")
#endif
#include "scan_edges.c"
#ifdef __clang__
#pragma clang attribute pop
#endif

#else

typedef int scan_edges_avx2_is_empty; /* C wants something in a file */

#endif
