/* avr_arithmetic.h: results and flags of arithmetic instructions, after the AVR instruction set manual. The flags are
 * those of avr_t: each in its own byte, 0 or 1.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#ifndef AVR_ARITHMETIC_H
#define AVR_ARITHMETIC_H

#include <stdbool.h>
#include <stdint.h>

#include "sim_avr.h"

static inline unsigned word_at(const uint8_t *bytes, uint32_t address) {
  return bytes[address] | (unsigned)bytes[address + 1] << 8;
}

static inline void put_word(uint8_t *bytes, unsigned address, unsigned value) {
  bytes[address] = (uint8_t)value;
  bytes[address + 1] = (uint8_t)(value >> 8);
}

static inline void flags_negative(uint8_t *f, bool negative) {
  f[S_N] = negative;
  f[S_S] = f[S_N] ^ f[S_V];
}

static inline void flags_logic(uint8_t *f, uint8_t result) {
  f[S_V] = 0;
  f[S_Z] = result == 0;
  flags_negative(f, result >> 7);
}

static inline uint8_t add(uint8_t *f, uint8_t a, uint8_t b, uint8_t carry) {
  unsigned sum = (unsigned)a + b + carry;
  uint8_t result = (uint8_t)sum;
  f[S_C] = (uint8_t)(sum >> 8);
  f[S_H] = (a ^ b ^ result) >> 4 & 1;
  f[S_V] = ((a ^ result) & (b ^ result)) >> 7;
  f[S_Z] = result == 0;
  flags_negative(f, result >> 7);
  return result;
}

/* `chained`: Z stays false where it was. */
static inline uint8_t subtract(uint8_t *f, uint8_t a, uint8_t b, uint8_t carry, bool chained) {
  unsigned difference = (unsigned)a - b - carry;
  uint8_t result = (uint8_t)difference;
  f[S_C] = difference >> 8 & 1;
  f[S_H] = (a ^ b ^ result) >> 4 & 1;
  f[S_V] = ((a ^ b) & (a ^ result)) >> 7;
  f[S_Z] = result == 0 && (!chained || f[S_Z]);
  flags_negative(f, result >> 7);
  return result;
}

static inline uint8_t shift_right(uint8_t *f, uint8_t value, uint8_t top) {
  uint8_t result = (uint8_t)(value >> 1 | top);
  f[S_C] = value & 1;
  f[S_Z] = result == 0;
  f[S_N] = result >> 7;
  f[S_V] = f[S_N] ^ f[S_C];
  f[S_S] = f[S_C]; /* N ^ V */
  return result;
}

static inline uint8_t count(uint8_t *f, uint8_t result, bool overflow) {
  f[S_V] = overflow;
  f[S_Z] = result == 0;
  flags_negative(f, result >> 7);
  return result;
}

static inline void add_word(uint8_t *f, uint8_t *pair, int number) {
  unsigned before = word_at(pair, 0), after = (before + (unsigned)number) & 0xFFFF;
  put_word(pair, 0, after);
  unsigned rises = after & ~before, falls = before & ~after;
  f[S_V] = (number >= 0 ? rises : falls) >> 15 & 1;
  f[S_C] = (number >= 0 ? falls : rises) >> 15 & 1;
  f[S_Z] = after == 0;
  flags_negative(f, after >> 15);
}

static inline uint8_t all_flags(const uint8_t *f) {
  unsigned found = 0;
  for (unsigned bit = 0; bit < 8; bit++) found |= (unsigned)f[bit] << bit;
  return (uint8_t)found;
}

#endif
