/* cobs.h: consistent overhead byte stuffing (Cheshire and Baker 1999) of frames, which are too short for a second code
 * byte. Each zero, and the place before the first byte, becomes the distance to the next such place or to the end.
 *
 * Stuffing goes backwards: so the distance is known where it is needed. */
#ifndef COBS_H
#define COBS_H

#include <stdbool.h>
#include <stdint.h>

#include "bounds.h"
#include "hal/hal.h"

/* What is being stuffed: the next byte goes in front of `to`, a place of hal_serial_beyond(). */
typedef struct {
  uint8_t *to;
  uint8_t distance; /* from the place before `to` to the next that was a zero, or to the end */
} cobs_stuffing;

static inline __attribute__((always_inline)) void cobs_put(cobs_stuffing *self, uint8_t byte) {
  if (byte == 0) {
    byte = self->distance;
    self->distance = 0;
  }
  self->distance++;
  hal_serial_put_before(&self->to, byte);
}

/* Puts `count` bytes, at least one and at most the constant `most`, the last of which is in front of `end`. */
static inline __attribute__((always_inline)) void cobs_put_all(cobs_stuffing *self, const uint8_t *end, uint8_t count,
                                                               uint8_t most) {
#ifdef __AVR__ /* 14 cycles a byte and one for a zero; the compiler, which cannot wrap an address in its low byte, needs 25 */
  uint8_t byte;
  __asm__ volatile(
      "1: ld %[byte], -%a[from]      \n"
      BOUNDED_ASM("%[most]")
      "tst %[byte]                   \n"
      "brne 2f                       \n"
      "mov %[byte], %[distance]      \n"
      "clr %[distance]               \n"
      "2: inc %[distance]            \n"
      "dec %A[to]                    \n"
      HAL_SEND_WRAP(to)
      "st %a[to], %[byte]            \n"
      "dec %[count]                  \n"
      "brne 1b                       \n"
      : [to] "+x"(self->to), [from] "+z"(end), [distance] "+r"(self->distance), [count] "+r"(count), [byte] "=&r"(byte)
      : [mask] "M"(HAL_SEND_MASK), [most] "n"(most)
      : "memory");
#else
  BOUNDED(most, for (; count != 0; count--)) {
    cobs_put(self, *--end);
  }
#endif
}

/* Takes the stuffing off in place; false unless it ends exactly at the end. count > 0. No byte is zero and the
 * first is at least 2, so that `most` + 2 bytes have at most `most` steps. */
static inline __attribute__((always_inline)) bool unstuff(uint8_t *bytes, uint8_t count, uint8_t most) {
  uint8_t step = *bytes;
  BOUNDED(most, while (step < count)) {
    count = (uint8_t)(count - step);
    bytes += step;
    step = *bytes;
    *bytes = 0;
  }
  return step == count;
}

#endif
