/* lanes.h: several numbers in one step of the processor, for loops that do the same with each.
 *
 * Each lane does what the scalar operation does, so results have the same bits, and a processor with wider registers
 * gives them as well. Where the compiler has no vectors LANES is 1, a lane is a number and the same code is scalar.
 * Vectors go to functions by their addresses: how they are passed by value depends on the processor.
 */
#ifndef GEOMETRY_LANES_H
#define GEOMETRY_LANES_H

#include <stdint.h>
#include <string.h>

#ifdef __GNUC__

#define LANES 4u
#define LANES_INLINE static inline __attribute__((always_inline))
#define LANES_NOT_INLINE __attribute__((noinline))

/* What is built for AVX2 anyway need not ask. The macro: for tests. */
#if defined(__x86_64__) && !defined(__AVX2__) && !defined(WORLD_PLAIN_LANES)
#define LANES_AVX2 LANES_NOT_INLINE __attribute__((target("avx2")))
#define LANES_HAVE_AVX2() __builtin_cpu_supports("avx2")
#endif

#ifdef __SSE2__
#include <emmintrin.h>
#endif

typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef int64_t masks __attribute__((vector_size(8 * LANES)));
typedef int32_t lanes_int __attribute__((vector_size(4 * LANES)));

/* Lanes of `yes` where the mask is set, else of `no`. */
#define lanes_select(mask, yes, no) ((lanes)(((masks)(yes) & (mask)) | ((masks)(no) & ~(mask))))
#define lanes_of(value) ((lanes){(value), (value), (value), (value)})

LANES_INLINE int masks_any(const masks *m) {
#ifdef __SSE2__
  return _mm_movemask_ps((__m128) __builtin_convertvector(*m, lanes_int)) != 0;
#else
  return ((*m)[0] | (*m)[1] | (*m)[2] | (*m)[3]) != 0;
#endif
}

/* to = {value for k = from, from + 1, ...}: numbers from several places, which become a vector without a detour by memory,
 * where those written one by one could not be read together at once. */
#define LANES_GATHER(to, k, from, value)              \
  do {                                                \
    size_t k = (from);                                \
    const double first_ = (value);                    \
    k++;                                              \
    const double second_ = (value);                   \
    k++;                                              \
    const double third_ = (value);                    \
    k++;                                              \
    const double fourth_ = (value);                   \
    (to) = (lanes){first_, second_, third_, fourth_}; \
  } while (0)

#else

#define LANES 1u
#define LANES_INLINE static inline
#define LANES_NOT_INLINE

typedef double lanes;
typedef int masks;

#define LANES_GATHER(to, k, from, value) \
  do {                                   \
    const size_t k = (from);             \
    (to) = (value);                      \
  } while (0)

#define lanes_select(mask, yes, no) ((mask) ? (yes) : (no))
#define lanes_of(value) (value)

LANES_INLINE int masks_any(const masks *m) { return *m; }

#endif

/* Defines the function `name`, `linkage` extern or static, which does what `name`_inline does: by AVX2 where the processor
 * has it. `arguments` are the names in `parameters`. It should call nothing often: between code for AVX2 and other code
 * processors lose time. */
#ifdef LANES_AVX2
#define LANES_FUNCTION(linkage, name, parameters, arguments)                           \
  LANES_NOT_INLINE static void name##_anywhere parameters { name##_inline arguments; } \
  LANES_AVX2 static void name##_by_avx2 parameters { name##_inline arguments; }        \
  linkage void name parameters {                                                       \
    if (LANES_HAVE_AVX2()) {                                                           \
      name##_by_avx2 arguments;                                                        \
    } else {                                                                           \
      name##_anywhere arguments;                                                       \
    }                                                                                  \
  }
#else
#define LANES_FUNCTION(linkage, name, parameters, arguments) \
  linkage void name parameters { name##_inline arguments; }
#endif

LANES_INLINE void lanes_load(lanes *to, const double *from) { memcpy(to, from, sizeof *to); }

LANES_INLINE void lanes_store(double *to, const lanes *from) { memcpy(to, from, sizeof *from); }

#endif
