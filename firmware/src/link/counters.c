/* counters.c: see counters.h. */
#include "link/counters.h"

#include <string.h>

#include "hal/hal.h"
#include "link/link.h"
#include "link/send.h"
#include "link/session.h"
#include "link/telemetry.h"
#include "task_times.h"

#define PERIOD 4u /* ticks on a fast line */

msg_counters counters;
static bool bytes_lost;
static uint8_t due_in;          /* ticks */
static msg_task_time task_time; /* the last that was told */

void counters_start(void) {
  HAL_ZERO(counters);
  HAL_ZERO(bytes_lost);
  HAL_ZERO(due_in);
  HAL_ZERO(task_time);
}

void counters_count_at(uint8_t offset) {
  uint8_t *const at = (uint8_t *)&counters + offset;
  uint16_t count = 0;
  memcpy(&count, at, sizeof count);
  count++;
  memcpy(at, &count, sizeof count);
}

bool counters_bytes_lost(void) {
  const bool lost = bytes_lost;
  bytes_lost = false;
  return lost;
}

void counters_task(void) {
  if (hal_serial_overrun()) {
    counters_count(overrun);
    bytes_lost = true;
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
    send_message(MSG_COUNTERS_ID, &counters, sizeof counters);
    task_time.task = UINT8_MAX; /* the next is the first task's turn */
    return;
  }
  task_time.longest = task_times_longest(task);
  send_message(MSG_TASK_TIME_ID, &task_time, sizeof task_time);
}
