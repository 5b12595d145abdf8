/* noise_block.c: see noise_block.h. The ziggurat of noise.h, four draws to a register: the same integer operations in
 * each lane, and floating-point operations that are exact but for the last product, which is rounded as noise.h does. */
#include "noise_block.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(WORLD_PLAIN_LANES) /* the macro: for tests */
#define BY_AVX2 1
#include <immintrin.h>
#endif

#define BLOCK 64u /* draws between two looks for those outside: a bit each */

/* What is mixed: keys from memory, or one key with steps in a row. */
typedef struct {
  const uint64_t *keys; /* NULL: `key` ^ step */
  uint64_t key, step;
} source;

static uint64_t word(const source *s, size_t i) { return s->keys != NULL ? s->keys[i] : s->key ^ (s->step + i); }

static void plain(const source *s, double *draws, size_t from, size_t count) {
  for (size_t i = from; i < count; i++) draws[i] = noise_normal_of(hash_mix(word(s, i)));
}

#ifdef BY_AVX2

#define AVX2 __attribute__((target("avx2")))
#define INLINE static inline __attribute__((always_inline, target("avx2")))

/* The low 64 bits of x times a constant: three products of 32 bits. */
INLINE __m256i times(__m256i x, uint64_t constant) {
  const __m256i c = _mm256_set1_epi64x((long long)constant);
  const __m256i upper =
      _mm256_add_epi64(_mm256_mul_epu32(_mm256_srli_epi64(x, 32), c), _mm256_mul_epu32(x, _mm256_srli_epi64(c, 32)));
  return _mm256_add_epi64(_mm256_mul_epu32(x, c), _mm256_slli_epi64(upper, 32));
}

/* hash_mix */
INLINE __m256i mix(__m256i x) {
  x = _mm256_add_epi64(x, _mm256_set1_epi64x((long long)0x9e3779b97f4a7c15u));
  x = times(_mm256_xor_si256(x, _mm256_srli_epi64(x, 30)), 0xbf58476d1ce4e5b9u);
  x = times(_mm256_xor_si256(x, _mm256_srli_epi64(x, 27)), 0x94d049bb133111ebu);
  return _mm256_xor_si256(x, _mm256_srli_epi64(x, 31));
}

/* (double)(bits >> 11) * 2^-52 - 1, all of it exact: the upper 21 and the lower 32 of the 53 bits become the low bits of
 * a number near 2^32 and of one near 1, of which the units in the last place are 2^-20 and 2^-52. */
INLINE __m256d place(__m256i bits) {
  const __m256i whole = _mm256_srli_epi64(bits, 11);
  const __m256d low = _mm256_castsi256_pd(_mm256_blend_epi32(whole, _mm256_set1_epi64x(0x3ff0000000000000), 0xaa));
  const __m256d high =
      _mm256_castsi256_pd(_mm256_or_si256(_mm256_srli_epi64(whole, 32), _mm256_set1_epi64x(0x41f0000000000000)));
  return _mm256_add_pd(_mm256_sub_pd(high, _mm256_set1_pd(0x1p32 + 2.0)), low);
}

/* Edges `layer` and `layer` + 1 of each lane. */
INLINE void edges_of(__m256i bits, __m256d *here, __m256d *next) {
  const __m256i layer = _mm256_and_si256(bits, _mm256_set1_epi64x(NOISE_LAYERS - 1));
  const __m128i low = _mm256_castsi256_si128(layer);
  const __m128i high = _mm256_extracti128_si256(layer, 1);
  const double *table = noise_layer_edges;
  const __m128d first = _mm_loadu_pd(table + _mm_cvtsi128_si64(low));
  const __m128d second = _mm_loadu_pd(table + _mm_extract_epi64(low, 1));
  const __m128d third = _mm_loadu_pd(table + _mm_cvtsi128_si64(high));
  const __m128d fourth = _mm_loadu_pd(table + _mm_extract_epi64(high, 1));
  const __m256d even = _mm256_insertf128_pd(_mm256_castpd128_pd256(first), third, 1);
  const __m256d odd = _mm256_insertf128_pd(_mm256_castpd128_pd256(second), fourth, 1);
  *here = _mm256_unpacklo_pd(even, odd);
  *next = _mm256_unpackhi_pd(even, odd);
}

/* Four draws; of those outside their layer's rectangle, which are wrong yet, the bits are set. */
INLINE uint64_t four(__m256i bits, double *draws) {
  __m256d here, next;
  edges_of(bits, &here, &next);
  const __m256d x = _mm256_mul_pd(place(bits), here);
  _mm256_storeu_pd(draws, x);
  const __m256d size = _mm256_andnot_pd(_mm256_set1_pd(-0.0), x);
  return (uint64_t)(unsigned)_mm256_movemask_pd(_mm256_cmp_pd(size, next, _CMP_NLT_UQ));
}

INLINE __m256i load(const uint64_t *from) { return _mm256_loadu_si256((const __m256i *)(const void *)from); }

/* As many draws as make whole registers; returns how many. */
AVX2 static size_t by_avx2(const source *s, double *draws, size_t count) {
  const size_t end = count / 4 * 4;
  const __m256i key = _mm256_set1_epi64x((long long)s->key);
  __m256i step = _mm256_add_epi64(_mm256_set1_epi64x((long long)s->step), _mm256_setr_epi64x(0, 1, 2, 3));
  for (size_t block = 0; block < end; block += BLOCK) {
    const size_t some = end - block < BLOCK ? end - block : BLOCK;
    uint64_t outside = 0;
    if (s->keys != NULL) {
      for (size_t i = 0; i < some; i += 4) outside |= four(mix(load(s->keys + block + i)), draws + block + i) << i;
    } else {
      for (size_t i = 0; i < some; i += 4) {
        outside |= four(mix(_mm256_xor_si256(key, step)), draws + block + i) << i;
        step = _mm256_add_epi64(step, _mm256_set1_epi64x(4));
      }
    }
    for (; outside != 0; outside &= outside - 1) {
      const size_t i = block + (size_t)__builtin_ctzll(outside);
      draws[i] = noise_normal_outside(hash_mix(word(s, i)));
    }
  }
  return end;
}

#endif

static void draw(const source *s, double *draws, size_t count) {
  size_t done = 0;
#ifdef BY_AVX2
  if (count >= 4 && __builtin_cpu_supports("avx2")) done = by_avx2(s, draws, count);
#endif
  plain(s, draws, done, count);
}

void noise_block_normals(const uint64_t *keys, double *draws, size_t count) {
  draw(&(source){.keys = keys}, draws, count);
}

void noise_block_next(noise_source *self, double *draws, size_t count) {
  if (!self->on) {
    for (size_t i = 0; i < count; i++) draws[i] = 0.0;
    return;
  }
  if (!self->keyed) {
    self->key = noise_key(self->seed, self->robot, self->device);
    self->keyed = 1;
  }
  draw(&(source){.key = self->key, .step = self->step}, draws, count);
  self->step += count;
}
