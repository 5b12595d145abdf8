/* clock.h: the board's time: slots of 2.5 ms, control ticks of four slots, cycles and microseconds. */
#ifndef CLOCK_H
#define CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

#define CLOCK_SLOTS_PER_TICK 4u
#define CLOCK_SLOTS_PER_FRAME 8u /* of a servo frame, 20 ms */
#define CLOCK_TICK_RATE 100u     /* Hz */
#define CLOCK_TICK_US 10000u

/* The first tick to come is `first_tick`: 0 but for tests of what happens where counts roll over. */
void clock_start(uint32_t first_tick);

/* Low byte of the number of the slot that has begun, and of the first one whose tasks have not run. */
extern volatile uint8_t clock_slot;
extern uint8_t clock_next_slot;

/* Slots that have begun and whose tasks have not run. */
HAL_INLINE uint8_t clock_waiting(void) { return (uint8_t)(clock_slot + 1u - clock_next_slot); }

/* In a task: the number of its slot within the servo frame, 0..7, and whether it is the first one of a tick. */
HAL_INLINE uint8_t clock_frame_slot(void) { return clock_next_slot % CLOCK_SLOTS_PER_FRAME; }
HAL_INLINE bool clock_tick_begins(void) { return clock_next_slot % CLOCK_SLOTS_PER_TICK == 0; }

/* Ages of readings, in ticks; AGE_NEVER: there was none yet, or it is at least as old. */
#define AGE_NEVER 255u
HAL_INLINE void clock_grow_older(uint8_t *age) {
  if (*age < AGE_NEVER) {
    (*age)++;
  }
}

/* The control tick whose tasks run now; when they all have run, the next one, which may not have begun yet. */
uint32_t clock_tick(void);

/* The board's time in us modulo 2^32: now, and at the start of clock_tick(). Tick n begins at n * CLOCK_TICK_US, so
 * the moments before the first tick count down from 2^32. Main loop only. */
uint32_t clock_time(void);
uint32_t clock_tick_time(void);

/* The low half of the number of the tick that has begun. Main loop only. */
uint16_t clock_begun_tick(void);

/* Cycles since the timers started, modulo 2^32 (268 s); the low half is hal_time(). Main loop only. */
uint32_t clock_now(void);

/* In an interrupt: the same for the moment, at most 1 ms before the present slot began or within it, at which hal_time() was
 * `time`. */
extern volatile uint32_t clock_slot_cycles; /* time at which the slot began; its low half is the count's */
HAL_INLINE uint32_t clock_cycles_in(uint32_t slot_cycles, uint16_t time) { /* the slot began at `slot_cycles` */
  const uint16_t since = (uint16_t)(time - (uint16_t)slot_cycles);
  return slot_cycles + since - (uint32_t)(since >= 0xC000u ? 0x10000ul : 0ul);
}
HAL_INLINE uint32_t clock_cycles_at(uint16_t time) { return clock_cycles_in(clock_slot_cycles, time); }

/* In the slot's interrupt: the next slot has begun. Returns the time, as hal_time() counts, at which it did. */
uint16_t clock_begin_slot(void);

/* When all tasks of a tick have run: the next one's turn. */
void clock_next_tick(void);

#endif
