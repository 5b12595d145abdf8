/* counter_messages.c: see counter_messages.h. */
#include "link/counter_messages.h"

#include <stdint.h>

#include "events.h"
#include "generated/values.h"
#include "link/counters.h"
#include "link/receive.h"
#include "link/send.h"
#include "link/session_seed.h"
#include "link/telemetry.h"
#include "task_times.h"
#include "tasks.h"

#define PERIOD 4u /* ticks on a fast line */

static uint8_t due_in;          /* ticks */
static msg_task_time task_time; /* the last that was sent */

void counter_messages_start(void) {
  due_in = 0;
  task_time.task = 0;
}

/* In every tick: counts whether received bytes were lost; in a session sends one task's longest time or the counters every
 * 4 ticks, on slow lines less often. */
void counters_task(void) {
  counters_end_tick();
  if (due_in != 0) {
    due_in--;
    return;
  }
  if (!session_is_open() || !send_has_room(sizeof counters)) {
    return;
  }
  due_in = (uint8_t)(PERIOD * telemetry_line_period() - 1u); /* 39 on the slowest line */
  const uint8_t task = ++task_time.task;
  if (task == TASK_COUNT) { /* of all images, so that every round is the same */
    receive_count(&counters);
    counters.deferred = events_deferred();
    send_message(MSG_COUNTERS_ID, &counters, sizeof counters);
    task_time.task = UINT8_MAX; /* the next is the first task's turn */
    return;
  }
  task_time.longest = task_times_longest(task);
  send_message(MSG_TASK_TIME_ID, &task_time, sizeof task_time);
}
