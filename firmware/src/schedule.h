/* schedule.h: the tick. A time-triggered cyclic executive after tasks.def: Timer1 begins a slot (clock.h) every 2.5 ms; the
 * slot's interrupt starts what needs an exact time, the main loop then runs the tasks that are due. */
#ifndef SCHEDULE_H
#define SCHEDULE_H

#include <stdbool.h>
#include <stdint.h>

/* The first tick to come is `first_tick`: 0 but for tests of what happens where counts roll over. */
void schedule_start(uint32_t first_tick);

/* Runs the tasks of the next slot that has begun; one is waiting. (`noinline`, here and at what a poll is made of: a function
 * by itself, so that `boebot timing` finds it by its name.) */
void schedule_poll(void) __attribute__((noinline));

/* Ticks whose work did not end in time since reset, modulo 256; and whether the previous one did not. */
uint8_t schedule_overruns(void);
bool schedule_overran(void);

#endif
