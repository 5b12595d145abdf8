/* avr_timer_count.h: what the two files of the timers share: avr_timers.c has the registers, avr_timer_count.c counts.
 */
#ifndef AVR_TIMER_COUNT_H
#define AVR_TIMER_COUNT_H

#include "avr_parts.h"

enum { CONTROL_A, CONTROL_B, CONTROL_C };                      /* TCCRnA, TCCRnB, TCCR1C follow each other */
enum { ACTION_NONE, ACTION_TOGGLE, ACTION_CLEAR, ACTION_SET }; /* COMnx */

static inline bool counts_down(const timer_state *t) {
  return t->mode == COUNT_PHASE_PWM || t->mode == COUNT_PHASE_FREQUENCY_PWM;
}

static inline bool is_buffered(const timer_state *t) { return t->mode >= COUNT_FAST_PWM; }

static inline bool is_wide(const timer_state *t) { return t->maximum > 0xFF; }

/* TCNTn gets a value, by a write or because the mode has changed: the timer counts on in its direction, up where that is 0
 * or the mode has no way down. */
void timer_set_count(timer_state *t, uint32_t count);

/* Whether a channel drives its pin in place of the port. */
bool timer_takes_over_pin(const timer_state *t, int channel);

/* One count at that cycle, with all that it causes. */
void timer_count_once(timer_state *t, uint64_t cycle);

/* Acts as a compare match on the pin, not on the flag; not in PWM modes (15.9.2). */
void timer_force_match(timer_state *t, int channel, uint64_t cycle);

#endif
