/* image.c: size and checksum of the flash image. */
#include "hal/hal.h"

extern const uint8_t __data_load_end[]; /* by the linker: the first byte of flash after the image */

uint32_t hal_image_size(void) { return (uint16_t)(uintptr_t)__data_load_end; }

/* Bit by bit: a table would take no less time in an 8-bit CPU. */
uint32_t hal_image_hash(void) {
  uint32_t crc = 0xFFFFFFFFul;
  const uint16_t size = (uint16_t)hal_image_size();
  for (uint16_t address = 0; address < size; address++) {
    LOOP_BOUND(FLASHEND + 1ul);
    crc ^= pgm_read_byte(address);
    for (uint8_t bit = 0; bit < 8u; bit++) {
      const bool carry = ((uint8_t)crc & 1u) != 0;
      crc >>= 1;
      if (carry) {
        crc ^= 0xEDB88320ul;
      }
    }
  }
  return ~crc;
}
