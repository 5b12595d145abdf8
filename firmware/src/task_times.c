/* task_times.c: see task_times.h. */
#include "task_times.h"

#include "clock.h"
#include "reset.h"
#include "tasks.h"

static uint16_t longest[TASK_COUNT];
static uint32_t began;  /* clock_now() */
static uint8_t running; /* the task that runs */

void task_times_start(void) {
  for (uint8_t task = 0; task < TASK_COUNT; task++) {
    longest[task] = 0;
  }
}

void task_begins(uint8_t task) {
  running = task;
  reset_note_running((uint8_t)(task + 1u));
  began = clock_now();
}

void task_has_ended(void) {
  const uint32_t took = clock_now() - began;
  uint16_t *const most = &longest[running];
  if (took > *most) {
    *most = took < TASK_TIME_LONGEST ? (uint16_t)took : TASK_TIME_LONGEST;
  }
  reset_note_running(0);
}

uint16_t task_times_longest(uint8_t task) { return task < TASK_COUNT ? longest[task] : 0; }
