/* hash.h: hashes of numbers, the same on every machine: of values in a row, never of memory, which has padding and an order
 * of bytes. They differ for things that were not made to look alike. */
#ifndef GEOMETRY_HASH_H
#define GEOMETRY_HASH_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Finaliser of 64 bits: each bit of the result depends on each bit of x. */
static inline uint64_t hash_mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

static inline uint64_t hash_word(uint64_t sum, uint64_t word) { return hash_mix(sum ^ word); }

/* The bits of a number as a word. */
static inline uint64_t hash_bits(double value) {
  uint64_t bits;
  memcpy(&bits, &value, sizeof bits);
  return bits;
}

#endif
