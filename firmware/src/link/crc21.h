/* crc21.h: the checksum of frames, CRC-21 with the polynomial 0x1DBF6F (0x1edfb7 in Koopman's notation: Hamming distance 6 up
 * to 1004 bits), most significant bit first. Portable C.
 *
 * A table has the remainder of each byte (generated/crc21_table.h). The register is the top 21 of 24 bits, so that
 * bytes enter from the left, and in three variables, which suits 8-bit CPUs as long as they are in line. */
#ifndef CRC21_H
#define CRC21_H

#include <stdint.h>

#include "generated/crc21_table.h"

#ifdef __AVR__
#define CRC21_ENTRY(table, index) pgm_read_byte(&(table)[index])
#else
#define CRC21_ENTRY(table, index) ((table)[index])
#endif
#define CRC21_INLINE static inline __attribute__((always_inline))

typedef struct {
  uint8_t high, middle, low;
} crc21;

/* A register that starts from a seed of 21 bits. */
CRC21_INLINE crc21 crc21_start(uint32_t seed) {
  const uint32_t aligned = seed << 3;
  return (crc21){(uint8_t)(aligned >> 16), (uint8_t)(aligned >> 8), (uint8_t)aligned};
}

CRC21_INLINE void crc21_add(crc21 *crc, uint8_t byte) {
  const uint8_t index = crc->high ^ byte;
  crc->high = crc->middle ^ CRC21_ENTRY(CRC21_HIGH, index);
  crc->middle = crc->low ^ CRC21_ENTRY(CRC21_MIDDLE, index);
  crc->low = CRC21_ENTRY(CRC21_LOW, index);
}

/* The 21 bits as three bytes of seven, each under a set top bit: as on the wire. */
CRC21_INLINE void crc21_put(crc21 crc, uint8_t *to) {
  to[0] = (uint8_t)(0x80u | crc.high >> 1);
  to[1] = (uint8_t)(0x80u | (uint8_t)(crc.high << 6) | crc.middle >> 2);
  to[2] = (uint8_t)(0x80u | (uint8_t)(crc.middle << 5) | crc.low >> 3);
}

#endif
