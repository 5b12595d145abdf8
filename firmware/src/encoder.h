/* encoder.h: wheel encoders on pin-change interrupts: counts of edges and the time between the last two.
 *
 * One line per wheel counts up whatever the direction; two lines (ENCODER_LINES 2) count down when the wheel turns
 * backward. Forward is A leading B: (A, B) runs 00, 10, 11, 01. The pin map says which it is.
 * A line that fires more often in a tick than the parameter encoder_limit allows, or whose changes come back to back
 * (hal.h), is masked until the next tick; so are all lines when the noise cannot be told to be one line's. What a masked
 * line did is not known: it gives no period, neither then nor across the gap. */
#ifndef ENCODER_H
#define ENCODER_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  int32_t count;   /* edges since reset */
  uint16_t period; /* time between the last two edges in 16 us; 0: none within 0.5 s */
  bool masked;     /* a line of this wheel was masked in the tick that ended */
} encoder_reading;

void encoder_start(void);

/* Works off the changes that the interrupt has stamped: before the clock's 16 bits roll over (4 ms), that is in every
 * slot, and sooner when they pile up. */
void encoder_poll(void) __attribute__((noinline));

/* Not 0 if they have piled up to an eighth of the ring, or were stopped. */
static inline __attribute__((always_inline)) uint8_t encoder_due(void) {
  return (uint8_t)(hal_changes_stopped() | ((uint8_t)(hal_changes_head - hal_changes_tail) & 0xE0u));
}

/* Once per tick: closes the tick's readings and lifts masks. */
void encoder_task(void) __attribute__((noinline));

/* The reading at the start of this tick. */
const encoder_reading *encoder_read(uint8_t side);

/* Change of the count for one step of two lines, each (A << 1 | B): forward while the new B is the old A. 0 also where
 * both changed, which tells nothing. */
static inline int8_t encoder_quadrature_step(uint8_t from, uint8_t to) {
  const uint8_t changed = from ^ to;
  if (changed != 1u && changed != 2u) {
    return 0;
  }
  return (from >> 1) == (to & 1u) ? 1 : -1;
}

/* The next change of another line of the port, `bit` of it, is stamped, once; 0: none is awaited. Noise that stops the
 * interrupt ends the waiting. */
void encoder_await_other(uint8_t bit);

/* Whether that change has come, and when: as schedule_now(). After encoder_poll(). */
bool encoder_saw_other(void);
uint32_t encoder_other_edge(void);

#ifdef __cplusplus
}
#endif

#endif
