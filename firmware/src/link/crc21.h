/* crc21.h: the table of CRC-21 (polynomial 0x1DBF6F, 0x1edfb7 in Koopman's notation: Hamming distance 6 up to 1004
 * bits), most significant bit first, in the top 21 of 24 bits.
 *
 * A CRC is linear: the entry of a byte is the XOR of the entries of its bits. CRC21_BIT_n is the entry of 1 << n; each is
 * the one before, shifted by one and reduced, which the assertions check. Three tables of bytes suit an 8-bit CPU. */
#ifndef CRC21_H
#define CRC21_H

#include <stdint.h>

#include "bounds.h"
#include "hal/hal.h"

#define CRC21_BIT_0 0xEDFB78ul /* the polynomial, shifted by three */
#define CRC21_BIT_1 0x360D88ul
#define CRC21_BIT_2 0x6C1B10ul
#define CRC21_BIT_3 0xD83620ul
#define CRC21_BIT_4 0x5D9738ul
#define CRC21_BIT_5 0xBB2E70ul
#define CRC21_BIT_6 0x9BA798ul
#define CRC21_BIT_7 0xDAB448ul

#define CRC21_STEP(entry) ((((entry) << 1) ^ (((entry) >> 23) != 0 ? CRC21_BIT_0 : 0ul)) & 0xFFFFFFul)
_Static_assert(CRC21_BIT_0 == (0x1DBF6Ful << 3 & 0xFFFFFFul), "polynomial");
_Static_assert(CRC21_BIT_1 == CRC21_STEP(CRC21_BIT_0), "bit 1");
_Static_assert(CRC21_BIT_2 == CRC21_STEP(CRC21_BIT_1), "bit 2");
_Static_assert(CRC21_BIT_3 == CRC21_STEP(CRC21_BIT_2), "bit 3");
_Static_assert(CRC21_BIT_4 == CRC21_STEP(CRC21_BIT_3), "bit 4");
_Static_assert(CRC21_BIT_5 == CRC21_STEP(CRC21_BIT_4), "bit 5");
_Static_assert(CRC21_BIT_6 == CRC21_STEP(CRC21_BIT_5), "bit 6");
_Static_assert(CRC21_BIT_7 == CRC21_STEP(CRC21_BIT_6), "bit 7");

#define CRC21_IF(byte, n) (((byte) >> (n)&1) != 0 ? CRC21_BIT_##n : 0ul)
#define CRC21_ENTRY(byte)                                                                              \
  (CRC21_IF(byte, 0) ^ CRC21_IF(byte, 1) ^ CRC21_IF(byte, 2) ^ CRC21_IF(byte, 3) ^ CRC21_IF(byte, 4) ^ \
   CRC21_IF(byte, 5) ^ CRC21_IF(byte, 6) ^ CRC21_IF(byte, 7))

#define CRC21_4(part, byte) part(byte), part((byte) + 1), part((byte) + 2), part((byte) + 3)
#define CRC21_16(part, byte) \
  CRC21_4(part, byte), CRC21_4(part, (byte) + 4), CRC21_4(part, (byte) + 8), CRC21_4(part, (byte) + 12)
#define CRC21_64(part, byte) \
  CRC21_16(part, byte), CRC21_16(part, (byte) + 16), CRC21_16(part, (byte) + 32), CRC21_16(part, (byte) + 48)
#define CRC21_256(part) CRC21_64(part, 0), CRC21_64(part, 64), CRC21_64(part, 128), CRC21_64(part, 192)

#define CRC21_HIGH(byte) (uint8_t)(CRC21_ENTRY(byte) >> 16)
#define CRC21_MIDDLE(byte) (uint8_t)(CRC21_ENTRY(byte) >> 8 & 0xFFu)
#define CRC21_LOW(byte) (uint8_t)(CRC21_ENTRY(byte) & 0xFFu)

/* High, middle and low bytes of all entries, one after another; aligned, so that the index is the low byte of the address. */
HAL_TABLE uint8_t crc21_table[3 * 256]
    __attribute__((aligned(256))) = {CRC21_256(CRC21_HIGH), CRC21_256(CRC21_MIDDLE), CRC21_256(CRC21_LOW)};

/* The register, in the top 21 of 24 bits, so that bytes enter from the left. */
typedef struct {
  uint8_t high, middle, low;
} crc21;

/* crc21_take(crc, byte)                takes one byte in
 * crc21_take_all(crc, bytes, count, most)    takes bytes in, at least one and at most the constant `most`
 * crc21_take_sent(crc, place, count, most)   the same from a place of hal_serial_beyond() on, which moves on
 * crc21_spread(crc)                    makes its 21 bits three bytes of seven, each with its top bit set
 * crc21_align(seed)                    a seed in the top 21 of 24 bits; what is above them stays */
#ifdef __AVR__
/* 15 cycles for what is in `byte`, of the 320 that a byte has on the line; the compiler, which does not know that the table
 * is aligned, needs 30. */
#define CRC21_TAKE                  \
  "eor %[high], %[byte]         \n" \
  "mov r30, %[high]             \n" \
  "ldi r31, hi8(%[table])       \n" \
  "lpm %[high], Z               \n" \
  "eor %[high], %[middle]       \n" \
  "inc r31                      \n" \
  "lpm %[middle], Z             \n" \
  "eor %[middle], %[low]        \n" \
  "inc r31                      \n" \
  "lpm %[low], Z                \n"
#define CRC21_REGISTER [high] "+r"(crc->high), [middle] "+r"(crc->middle), [low] "+r"(crc->low)

static inline __attribute__((always_inline)) void crc21_take_all(crc21 *crc, const uint8_t *bytes, uint8_t count,
                                                                 uint8_t most) {
  uint8_t byte;
  __asm__ volatile("1: ld %[byte], %a[bytes]+ \n" BOUNDED_ASM("%[most]") CRC21_TAKE
                   "dec %[count]              \n"
                   "brne 1b                   \n"
                   : CRC21_REGISTER, [bytes] "+x"(bytes), [count] "+r"(count), [byte] "=&r"(byte)
                   : [table] "i"(crc21_table), [most] "n"(most)
                   : "r30", "r31", "memory");
}

static inline __attribute__((always_inline)) void crc21_take_sent(crc21 *crc, uint8_t **place, uint8_t count,
                                                                  uint8_t most) {
  uint8_t byte;
  __asm__ volatile("1: ld %[byte], %a[place]        \n" BOUNDED_ASM("%[most]") CRC21_TAKE
                   "inc %A[place]                   \n"
                   HAL_SEND_WRAP(place)
                   "dec %[count]                    \n"
                   "brne 1b                         \n"
                   : CRC21_REGISTER, [place] "+x"(*place), [count] "+r"(count), [byte] "=&r"(byte)
                   : [table] "i"(crc21_table), [mask] "M"(HAL_SEND_MASK), [most] "n"(most)
                   : "r30", "r31", "memory");
}

static inline __attribute__((always_inline)) void crc21_spread(crc21 *crc) {
  __asm__(
      "sec           \n"
      "ror %[high]   \n"
      "ror %[middle] \n"
      "ror %[low]    \n"
      "sec           \n"
      "ror %[middle] \n"
      "ror %[low]    \n"
      "sec           \n"
      "ror %[low]    \n"
      : CRC21_REGISTER);
}

static inline __attribute__((always_inline)) uint32_t crc21_align(uint32_t seed) {
#define CRC21_SHIFT "lsl %A[seed] \n rol %B[seed] \n rol %C[seed] \n"
  __asm__(CRC21_SHIFT CRC21_SHIFT CRC21_SHIFT : [seed] "+r"(seed));
  return seed;
}
#else
static inline void crc21_take(crc21 *crc, uint8_t byte) {
  const uint8_t *entry = &crc21_table[crc->high ^ byte];
  *crc = (crc21){(uint8_t)(crc->middle ^ entry[0]), (uint8_t)(crc->low ^ entry[256]), entry[512]};
}

static inline void crc21_take_all(crc21 *crc, const uint8_t *bytes, uint8_t count, uint8_t most) {
  BOUNDED(most, for (; count != 0; count--)) {
    crc21_take(crc, *bytes++);
  }
}

static inline void crc21_take_sent(crc21 *crc, uint8_t **place, uint8_t count, uint8_t most) {
  crc21_take_all(crc, *place, count, most);
  *place += count;
}

static inline void crc21_spread(crc21 *crc) {
  *crc = (crc21){(uint8_t)(0x80u | crc->high >> 1), (uint8_t)(0x80u | (uint8_t)(crc->high << 6) | crc->middle >> 2),
                 (uint8_t)(0x80u | (uint8_t)(crc->middle << 5) | crc->low >> 3)};
}

static inline uint32_t crc21_align(uint32_t seed) { return (seed & 0xFF000000ul) | (seed << 3 & 0xFFFFFFul); }
#endif

#endif
