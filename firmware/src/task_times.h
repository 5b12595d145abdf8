/* task_times.h: the board times its own tasks: which one runs, and the longest time that each took.
 *
 * Measured with Timer1, in cycles, from a task's call to its return, with the interrupts that came in between. */
#ifndef TASK_TIMES_H
#define TASK_TIMES_H

#include <stdint.h>

/* The longest times start anew. */
void task_times_start(void);

/* Around each task. The number of the task that runs outlives a reset (reset.h). Main loop only. */
void task_begins(uint8_t task) __attribute__((noinline));
void task_has_ended(void);

#define TASK_TIME_LONGEST 0xFFFFu /* this long or longer; no run is this long on purpose */

/* The longest that a task took since task_times_start(); 0: it has not run, or this image has no such task. Main
 * loop only. */
uint16_t task_times_longest(uint8_t task);

#endif
