/* schedule.h: the tick. A time-triggered cyclic executive after tasks.def: Timer1 begins a slot every 2.5 ms; the slot's
 * interrupt starts what needs an exact time, the main loop then runs the tasks that are due. */
#ifndef SCHEDULE_H
#define SCHEDULE_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SCHEDULE_SLOTS_PER_TICK 4u
#define SCHEDULE_SLOTS_PER_FRAME 8u /* of a servo frame, 20 ms */
#define SCHEDULE_TICK_RATE 100u     /* Hz */
#define SCHEDULE_TICK_US 10000u

/* The first tick to come is `first_tick`: 0 but for tests of what happens where counts roll over. */
void schedule_start(uint32_t first_tick);

/* Low byte of the number of the slot that has begun, and of the first one whose tasks have not run. */
extern volatile uint8_t schedule_slot;
extern uint8_t schedule_next_slot;

/* Slots that have begun and whose tasks have not run. */
HAL_INLINE uint8_t schedule_waiting(void) { return (uint8_t)(schedule_slot + 1u - schedule_next_slot); }

/* Runs the tasks of the next slot that has begun; one is waiting. (`noinline`, here and at what a poll is made of: a function
 * by itself, so that `boebot timing` finds it by its name.) */
void schedule_poll(void) __attribute__((noinline));

/* In a task: the number of its slot within the servo frame, 0..7, and whether it is the first one of a tick. */
HAL_INLINE uint8_t schedule_frame_slot(void) { return schedule_next_slot % SCHEDULE_SLOTS_PER_FRAME; }
HAL_INLINE bool schedule_tick_begins(void) { return schedule_next_slot % SCHEDULE_SLOTS_PER_TICK == 0; }

/* The control tick whose tasks run now; when they all have run, the next one, which may not have begun yet. */
uint32_t schedule_tick(void);

/* The board's time in us modulo 2^32: now, and at the start of schedule_tick(). Tick n begins at n * SCHEDULE_TICK_US, so
 * the moments before the first tick count down from 2^32. Main loop only. */
uint32_t schedule_time(void);
uint32_t schedule_tick_time(void);

/* The low half of the number of the tick that has begun. Main loop only. */
uint16_t schedule_begun_tick(void);

/* Cycles since the timers started, modulo 2^32 (268 s); the low half is hal_time(). Main loop only. */
uint32_t schedule_now(void);

/* In an interrupt: the same for the moment, at most 1 ms before the present slot began or within it, at which hal_time() was
 * `time`. */
extern volatile uint32_t schedule_slot_cycles; /* time at which the slot began; its low half is the count's */
HAL_INLINE uint32_t schedule_cycles_in(uint32_t slot_cycles, uint16_t time) { /* the slot began at `slot_cycles` */
  const uint16_t since = (uint16_t)(time - (uint16_t)slot_cycles);
  return slot_cycles + since - (uint32_t)(since >= 0xC000u ? 0x10000ul : 0ul);
}
HAL_INLINE uint32_t schedule_cycles_at(uint16_t time) { return schedule_cycles_in(schedule_slot_cycles, time); }

/* Ticks whose work did not end in time since reset, modulo 256; and whether the previous one did not. */
uint8_t schedule_overruns(void);
bool schedule_overran(void);

#ifdef __cplusplus
}
#endif

#endif
