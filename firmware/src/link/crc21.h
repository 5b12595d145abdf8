/* crc21.h: the table of CRC-21 (polynomial 0x1DBF6F, 0x1edfb7 in Koopman's notation: Hamming distance 6 up to 1004
 * bits), most significant bit first, in the top 21 of 24 bits.
 *
 * A CRC is linear: the entry of a byte is the XOR of the entries of its bits. CRC21_BIT_n is the entry of 1 << n; each is
 * the one before, shifted by one and reduced, which the assertions check. Three tables of bytes suit an 8-bit CPU. */
#ifndef CRC21_H
#define CRC21_H

#include <stdint.h>

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

/* Takes one byte in. */
static inline __attribute__((always_inline)) void crc21_take(crc21 *crc, uint8_t byte) {
#ifdef __AVR__
  /* 16 cycles of the 320 that a byte has on the line; the compiler, which does not know the alignment, needs 30. */
  uint16_t entry;
  __asm__(
      "eor %[high], %[byte]       \n"
      "mov %A[entry], %[high]     \n"
      "ldi %B[entry], hi8(%[table])\n"
      "lpm %[high], %a[entry]     \n"
      "eor %[high], %[middle]     \n"
      "inc %B[entry]              \n"
      "lpm %[middle], %a[entry]   \n"
      "eor %[middle], %[low]      \n"
      "inc %B[entry]              \n"
      "lpm %[low], %a[entry]      \n"
      : [high] "+r"(crc->high), [middle] "+r"(crc->middle), [low] "+r"(crc->low), [entry] "=&z"(entry)
      : [byte] "r"(byte), [table] "i"(crc21_table));
#else
  const uint8_t *entry = &crc21_table[crc->high ^ byte];
  *crc = (crc21){(uint8_t)(crc->middle ^ entry[0]), (uint8_t)(crc->low ^ entry[256]), entry[512]};
#endif
}

#endif
