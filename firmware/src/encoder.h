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

/* Works off the changes that the interrupt has stamped. Whenever it is due. */
void encoder_poll(void) __attribute__((noinline));

/* The same, and tells from the clock when the edges were: before its 16 bits roll over (4 ms), that is before the tasks of
 * each slot. */
void encoder_update(void) __attribute__((noinline));

/* Not 0 if changes have piled up to an eighth of the ring, or were stopped. */
#define ENCODER_DUE_BYTES 0x20u
static inline __attribute__((always_inline)) uint8_t encoder_due(void) {
  return (uint8_t)(hal_changes_stopped() |
                   ((uint8_t)(hal_changes_head - hal_changes_tail) & (uint8_t) ~(ENCODER_DUE_BYTES - 1u)));
}

/* Once per tick, after encoder_update(): closes the tick's readings of what that has worked off, and lifts masks. */
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

/* The next fall of the left light sensor's line, which is on the same port, is stamped, once; it is high now. Noise that
 * stops the interrupt ends the waiting. */
void encoder_await_other(void);
void encoder_forget_other(void);

/* Whether it is still awaited, or has come and encoder_update() has not; whether it has come, and when: as
 * schedule_now(). */
bool encoder_awaits_other(void);
bool encoder_saw_other(void);
uint32_t encoder_other_edge(void);

#ifdef __cplusplus
}
#endif

#endif
