/* scan_lanes.h: several numbers at once, for scan_edges.c.
 *
 * Each lane does the operations of one number in the same order, so that wider registers give the same bits: four lanes
 * with SCAN_AVX2, else two, as every 64-bit processor has them. Where the compiler knows no vectors, or with
 * WORLD_PLAIN_LANES (for tests), a lane is a plain double, and the code reads as the definition.
 */
#ifndef GEOMETRY_SCAN_LANES_H
#define GEOMETRY_SCAN_LANES_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(__GNUC__) && !defined(WORLD_PLAIN_LANES)

#ifdef SCAN_AVX2
#define LANES 4
#else
#define LANES 2
#endif

typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef int64_t lanes_mask __attribute__((vector_size(8 * LANES)));
typedef int32_t lanes_int __attribute__((vector_size(4 * LANES)));

static inline lanes lanes_all(double x) { return x - (lanes){0}; }
static inline lanes lanes_pick(lanes_mask where, lanes yes, lanes no) {
  return (lanes)(((lanes_mask)yes & where) | ((lanes_mask)no & ~where));
}
static inline lanes lanes_keep(lanes_mask where, lanes x) { return (lanes)((lanes_mask)x & where); }
static inline lanes lanes_size(lanes x) { return (lanes)((lanes_mask)x & INT64_MAX); }
static inline lanes lanes_with_sign(lanes size, lanes sign) {
  return (lanes)((lanes_mask)size | ((lanes_mask)sign & INT64_MIN));
}
static inline lanes_int lanes_whole(lanes x) { return __builtin_convertvector(x, lanes_int); }

#else

#define LANES 1

typedef double lanes;
typedef int64_t lanes_mask;
typedef int32_t lanes_int;

static inline lanes lanes_all(double x) { return x; }
static inline lanes lanes_pick(lanes_mask where, lanes yes, lanes no) { return where ? yes : no; }
/* x, or 0 outside. */
static inline lanes lanes_keep(lanes_mask where, lanes x) { return where ? x : 0.0; }
static inline lanes lanes_size(lanes x) { return fabs(x); }
static inline lanes lanes_with_sign(lanes size, lanes sign) { return copysign(size, sign); }
/* Towards 0; |x| < 2^31. */
static inline lanes_int lanes_whole(lanes x) { return (int32_t)x; }

#endif

static inline lanes lanes_load(const double *from) {
  lanes x;
  memcpy(&x, from, sizeof x);
  return x;
}
static inline lanes_mask lanes_load_mask(const int64_t *from) {
  lanes_mask x;
  memcpy(&x, from, sizeof x);
  return x;
}
static inline void lanes_store(double *to, lanes x) { memcpy(to, &x, sizeof x); }
static inline void lanes_store_int(int32_t *to, lanes_int x) { memcpy(to, &x, sizeof x); }

/* The larger and the smaller one; b where neither is. */
static inline lanes lanes_larger(lanes a, lanes b) {
#if LANES == 4
  return _mm256_max_pd(a, b);
#elif LANES == 2 && defined(__SSE2__)
  return _mm_max_pd(a, b);
#else
  return lanes_pick(a > b, a, b);
#endif
}
static inline lanes lanes_smaller(lanes a, lanes b) {
#if LANES == 4
  return _mm256_min_pd(a, b);
#elif LANES == 2 && defined(__SSE2__)
  return _mm_min_pd(a, b);
#else
  return lanes_pick(a < b, a, b);
#endif
}

static inline lanes lanes_root(lanes x) {
#if LANES == 4
  return _mm256_sqrt_pd(x);
#elif LANES == 2
  return (lanes){sqrt(x[0]), sqrt(x[1])};
#else
  return sqrt(x);
#endif
}

/* To the nearest whole number below and above, |x| < 2^51: rounded by a sum, then corrected. */
static inline lanes lanes_floor(lanes x) {
  const lanes whole = (x + 0x1.8p52) - 0x1.8p52;
  return lanes_pick(whole > x, whole - 1.0, whole);
}
static inline lanes lanes_ceil(lanes x) {
  const lanes whole = (x + 0x1.8p52) - 0x1.8p52;
  return lanes_pick(whole < x, whole + 1.0, whole);
}

#endif
