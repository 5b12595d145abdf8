/* task_times.c: see task_times.h. */
#include "task_times.h"

#include "bounds.h"
#include "hal/hal.h"
#include "reset.h"
#include "schedule.h"

static uint16_t longest[TASKS];
static uint16_t began;     /* hal_time() */
static uint8_t began_slot; /* schedule_slot then */

void task_times_start(void) {
  BOUNDED(TASKS, for (uint8_t task = 0; task < TASKS; task++)) {
    longest[task] = 0;
  }
}

void task_begins(uint8_t task) {
  reset_note_running((uint8_t)(task + 1u));
  HAL_ATOMIC {
    began = hal_time();
    began_slot = schedule_slot;
  }
}

void task_has_ended(void) {
  uint16_t took = 0;
  uint16_t in_slot = 0;
  uint8_t slots = 0;
  HAL_ATOMIC {
    took = hal_time();
    in_slot = schedule_slot_start;
    slots = schedule_slot;
  }
  in_slot = (uint16_t)(took - in_slot);
  took = (uint16_t)(took - began);
  slots = (uint8_t)(slots - began_slot);
  /* The count of 16 bits has rolled over where the run took less than the slot that began during it has lasted. */
  if (slots > 1u || (slots == 1u && took < in_slot)) {
    took = TASK_TIME_LONGEST;
  }
  uint16_t *const most = &longest[reset_running() - 1u];
  if (took > *most) {
    *most = took;
  }
  reset_note_running(0);
}

uint16_t task_times_longest(uint8_t task) { return longest[task]; }
