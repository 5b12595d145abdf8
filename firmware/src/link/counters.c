/* counters.c: see counters.h. */
#include "link/counters.h"

#include "events.h"
#include "hal/hal.h"
#include "link/link.h"
#include "link/send.h"
#include "link/session.h"
#include "link/telemetry.h"
#include "task_times.h"
#include "tasks.h"

#define PERIOD 4u /* ticks on a fast line */

msg_counters counters;
static bool lost_in_tick, bytes_lost;
static uint8_t due_in;          /* ticks */
static msg_task_time task_time; /* the last that was told */

void counters_start(void) {
  counters = (msg_counters){0};
  lost_in_tick = bytes_lost = false;
  due_in = 0;
  task_time.task = 0;
}

void counters_lose_bytes(void) { lost_in_tick = true; }

bool counters_bytes_lost(void) {
  const bool lost = bytes_lost;
  bytes_lost = false;
  return lost;
}

/* In every tick: looks whether received bytes were lost; in a session sends one task's longest time or the counters
 * now and then. */
void counters_task(void) {
  if (hal_serial_overrun()) {
    counters_lose_bytes();
  }
  if (lost_in_tick) {
    counters.overrun++;
    bytes_lost = true;
    lost_in_tick = false;
  }
  if (due_in != 0) {
    due_in--;
    return;
  }
  if (!session_is_open() || !send_has_room(sizeof counters)) {
    return;
  }
  due_in = (uint8_t)(PERIOD * telemetry_line_period() - 1u); /* 39 on the slowest line */
  const uint8_t task = ++task_time.task;
  if (task == TASKS) {
    link_count(&counters);
    counters.deferred = events_deferred();
    send_message(MSG_COUNTERS_ID, &counters, sizeof counters);
    task_time.task = UINT8_MAX; /* the next is the first task's turn */
    return;
  }
  task_time.longest = task_times_longest(task);
  send_message(MSG_TASK_TIME_ID, &task_time, sizeof task_time);
}
