/* schedule.h: the tick. A time-triggered cyclic executive after tasks.def: Timer1 begins a slot every 2.5 ms; the slot
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
#define SCHEDULE_TICK_RATE 100u /* Hz */
#define SCHEDULE_TICK_US 10000u

/* The first tick to come is `first_tick`: 0 but for tests of what happens where counts roll over. */
void schedule_start(uint32_t first_tick);

/* Low byte of the number of the slot that has begun, and of the first one whose tasks have not run. */
extern volatile uint8_t schedule_slot;
extern uint8_t schedule_next_slot;

/* Slots that have begun and whose tasks have not run. */
static inline __attribute__((always_inline)) uint8_t schedule_waiting(void) {
  return (uint8_t)(schedule_slot + 1u - schedule_next_slot);
}

/* Runs the tasks of the next slot that has begun; one is waiting. */
void schedule_poll(void) __attribute__((noinline));

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

/* The same for the moment at which hal_time() was `time`, after the slot of that number (its low byte) had begun and
 * before 4 ms of it were over. Main loop only, within 0.6 s of it. */
uint32_t schedule_cycles_at(uint8_t slot, uint16_t time);

/* Ticks whose work did not end in time since reset, modulo 256; and whether the previous one did not. */
uint8_t schedule_overruns(void);
bool schedule_overran(void);

/* A moment, as interrupts note it: cheap to take, 640 ms long before it repeats. */
typedef struct {
  uint8_t slot;    /* low byte of the number of the slot that had begun */
  uint16_t offset; /* cycles since that slot began; an edge captured just before it counts from 65536 down */
} schedule_moment;

extern volatile uint16_t schedule_slot_start; /* hal_time() at which the slot began */

/* Interrupt context: the moment at which hal_time() was `time`. */
static inline schedule_moment schedule_moment_at(uint16_t time) {
  return (schedule_moment){schedule_slot, (uint16_t)(time - schedule_slot_start)};
}

/* Cycles from one moment to a later one. */
int32_t schedule_between(schedule_moment from, schedule_moment to);

#ifdef __cplusplus
}
#endif

#endif
