/* avr_arithmetic.h: results and flags of arithmetic instructions, after the AVR instruction set manual. The flags are kept
 * as the bytes that they follow from (avr_flags of avr_core.h).
 */
#ifndef AVR_ARITHMETIC_H
#define AVR_ARITHMETIC_H

#include "avr_core.h"

static inline uint16_t word_at(const uint8_t *bytes, uint32_t address) {
  return (uint16_t)(bytes[address] | bytes[address + 1] << 8);
}

static inline void put_word(uint8_t *bytes, uint32_t address, unsigned value) {
  bytes[address] = (uint8_t)value;
  bytes[address + 1] = (uint8_t)(value >> 8);
}

/* N, and S = N ^ V. */
static inline void sign(avr_flags *f, uint8_t result) {
  f->n = result;
  f->s = result ^ f->v;
}

static inline uint8_t add(avr_flags *f, uint8_t a, uint8_t b, uint8_t carry) {
  const unsigned sum = (unsigned)a + b + carry;
  const uint8_t result = (uint8_t)sum;
  f->c = (uint8_t)(sum >> 8);
  f->h = a ^ b ^ result;              /* bit 4: the carry out of bit 3 */
  f->v = (a ^ result) & (b ^ result); /* bit 7: both operands have the other sign */
  sign(f, f->z = result);
  return result;
}

/* CP, SUB, NEG. */
static inline uint8_t subtract(avr_flags *f, uint8_t a, uint8_t b) {
  const uint8_t result = (uint8_t)(a - b);
  f->c = a < b;
  f->h = a ^ b ^ result;
  f->v = (a ^ b) & (a ^ result);
  sign(f, f->z = result);
  return result;
}

/* CPC, SBC: Z stays false where it was, so that it is that of the whole number. */
static inline uint8_t subtract_with_carry(avr_flags *f, uint8_t a, uint8_t b) {
  const unsigned difference = (unsigned)a - b - f->c;
  const uint8_t result = (uint8_t)difference;
  f->c = difference >> 8 & 1u;
  f->h = a ^ b ^ result;
  f->v = (a ^ b) & (a ^ result);
  f->z |= result;
  sign(f, result);
  return result;
}

static inline uint8_t logic(avr_flags *f, unsigned result) {
  f->v = 0;
  sign(f, f->z = (uint8_t)result);
  return f->n;
}

/* `top`: what comes in at bit 7. V is N ^ C. */
static inline uint8_t shift_right(avr_flags *f, uint8_t value, unsigned top) {
  f->c = value & 1u;
  const uint8_t result = (uint8_t)(value >> 1 | top);
  f->v = (uint8_t)(result ^ f->c << 7);
  sign(f, f->z = result);
  return result;
}

/* INC, DEC: C stays. V: from 0x7F to 0x80, and back. */
static inline uint8_t count(avr_flags *f, uint8_t value, int by) {
  const uint8_t result = (uint8_t)(value + by);
  f->v = (uint8_t)(by > 0 ? result & ~value : value & ~result);
  sign(f, f->z = result);
  return result;
}

/* ADIW, SBIW. */
static inline void add_word(avr_flags *f, uint8_t *pair, unsigned number, bool subtracts) {
  const unsigned before = word_at(pair, 0), after = (subtracts ? before - number : before + number) & 0xFFFFu;
  const unsigned rises = after & ~before, falls = before & ~after;
  put_word(pair, 0, after);
  f->v = (uint8_t)((subtracts ? falls : rises) >> 8);
  f->c = (subtracts ? rises : falls) >> 15 & 1u;
  f->z = (uint8_t)(after | after >> 8);
  sign(f, (uint8_t)(after >> 8));
}

/* Into r1:r0. `fraction`: shifted left by one, behind C. */
static inline void multiply(avr_flags *f, uint8_t *data, int a, int b, unsigned fraction) {
  const unsigned product = (unsigned)(a * b), shown = product << fraction;
  f->c = product >> 15 & 1u;
  f->z = (uint8_t)(shown | shown >> 8);
  put_word(data, 0, shown);
}

/* ---- single flags, by their number in SREG ---- */

enum { FLAG_C, FLAG_Z, FLAG_N, FLAG_V, FLAG_S, FLAG_H, FLAG_T, FLAG_I };

static inline uint8_t all_flags(const avr_flags *f) {
  return (uint8_t)(f->c | (f->z == 0) << FLAG_Z | f->n >> 7 << FLAG_N | f->v >> 7 << FLAG_V | f->s >> 7 << FLAG_S |
                   (f->h >> 4 & 1) << FLAG_H | f->t << FLAG_T | f->i << FLAG_I);
}

static inline avr_flags flags_of(uint8_t sreg) {
  return (avr_flags){
      .c = sreg & 1u,
      .z = !(sreg >> FLAG_Z & 1u),
      .n = (uint8_t)(sreg << (7 - FLAG_N) & 0x80),
      .v = (uint8_t)(sreg << (7 - FLAG_V) & 0x80),
      .s = (uint8_t)(sreg << (7 - FLAG_S) & 0x80),
      .h = (uint8_t)(sreg >> (FLAG_H - 4) & 0x10),
      .t = sreg >> FLAG_T & 1u,
      .i = sreg >> FLAG_I,
  };
}

#endif
