/* avr_arithmetic.h: results and flags of arithmetic instructions, after the AVR instruction set manual. The flags are kept
 * as the bytes that they follow from (avr_flags of avr_core.h).
 */
#ifndef AVR_ARITHMETIC_H
#define AVR_ARITHMETIC_H

#include "avr_core.h"

static inline uint16_t word_at(const uint8_t *bytes, uint32_t address) {
  const volatile uint8_t *pair = bytes + address;
  return (uint16_t)(pair[0] | pair[1] << 8);
}

static inline void put_word(uint8_t *bytes, uint32_t address, unsigned value) {
  bytes[address] = (uint8_t)value;
  bytes[address + 1] = (uint8_t)(value >> 8);
}

/* Z, N, and S = N ^ V of what is computed before. Only bits 0 to 7 of `result` are looked at, but for Z. */
static inline uint8_t result_flags(avr_flags *f, uint8_t result) {
  f->z = f->n = result;
  f->s = f->n ^ f->v;
  return result;
}

static inline uint8_t add(avr_flags *f, unsigned a, unsigned b, unsigned carry) {
  const unsigned sum = a + b + carry;
  f->c = sum >> 8;
  f->h = a ^ b ^ sum;           /* bit 4: the carry out of bit 3 */
  f->v = (a ^ sum) & (b ^ sum); /* bit 7: both operands have the other sign */
  return result_flags(f, (uint8_t)sum);
}

/* CP, SUB, NEG. */
static inline uint8_t subtract(avr_flags *f, unsigned a, unsigned b) {
  const unsigned difference = a - b;
  f->c = difference >> 31;
  f->h = a ^ b ^ difference;
  f->v = (a ^ b) & (a ^ difference);
  return result_flags(f, (uint8_t)difference);
}

/* CPC, SBC: Z stays false where it was, so that it is that of the whole number. */
static inline uint8_t subtract_with_carry(avr_flags *f, unsigned a, unsigned b) {
  const uint32_t lower = f->z;
  const unsigned difference = a - b - f->c;
  f->c = difference >> 31;
  f->h = a ^ b ^ difference;
  f->v = (a ^ b) & (a ^ difference);
  result_flags(f, (uint8_t)difference);
  f->z |= lower;
  return (uint8_t)difference;
}

static inline uint8_t logic(avr_flags *f, unsigned result) {
  f->v = 0;
  return result_flags(f, (uint8_t)result);
}

/* `top`: what comes in at bit 7. V is N ^ C. */
static inline uint8_t shift_right(avr_flags *f, unsigned value, unsigned top) {
  const unsigned result = value >> 1 | top;
  f->c = value & 1u;
  f->v = result ^ f->c << 7;
  return result_flags(f, (uint8_t)result);
}

/* INC, DEC: C stays. V: from 0x7F to 0x80, and back. */
static inline uint8_t count(avr_flags *f, unsigned value, int by) {
  const unsigned result = value + (unsigned)by;
  f->v = by > 0 ? result & ~value : value & ~result;
  return result_flags(f, (uint8_t)result);
}

/* ADIW, SBIW. */
static inline void add_word(avr_flags *f, uint8_t *pair, unsigned number, bool subtracts) {
  const unsigned before = word_at(pair, 0), after = (subtracts ? before - number : before + number) & 0xFFFFu;
  const unsigned rises = after & ~before, falls = before & ~after;
  put_word(pair, 0, after);
  f->v = (subtracts ? falls : rises) >> 8;
  f->c = (subtracts ? rises : falls) >> 15 & 1u;
  result_flags(f, (uint8_t)(after >> 8));
  f->z = after;
}

/* Into r1:r0. `fraction`: shifted left by one, behind C. */
static inline void multiply(avr_flags *f, uint8_t *data, int a, int b, unsigned fraction) {
  const unsigned product = (unsigned)(a * b), shown = product << fraction & 0xFFFFu;
  f->c = product >> 15 & 1u;
  f->z = shown;
  put_word(data, 0, shown);
}

/* ---- single flags, by their number in SREG ---- */

enum { FLAG_C, FLAG_Z, FLAG_N, FLAG_V, FLAG_S, FLAG_H, FLAG_T, FLAG_I };

static inline uint8_t all_flags(const avr_flags *f) {
  return (uint8_t)(f->c | (f->z ? 0u : 1u) << FLAG_Z | (f->n >> 7 & 1) << FLAG_N | (f->v >> 7 & 1) << FLAG_V |
                   (f->s >> 7 & 1) << FLAG_S | (f->h >> 4 & 1) << FLAG_H | f->t << FLAG_T | f->i << FLAG_I);
}

static inline avr_flags flags_of(unsigned sreg) {
  return (avr_flags){
      .c = sreg & 1u,
      .z = !(sreg >> FLAG_Z & 1u),
      .n = sreg << (7 - FLAG_N),
      .v = sreg << (7 - FLAG_V),
      .s = sreg << (7 - FLAG_S),
      .h = sreg >> (FLAG_H - 4),
      .t = sreg >> FLAG_T & 1u,
      .i = sreg >> FLAG_I & 1u,
  };
}

#endif
