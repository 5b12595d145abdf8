/* safety.c: see safety.h. */
#include "safety.h"

#include "generated/messages.h"
#include "link/parameters.h"
#include "motion.h"
#include "schedule.h"

#define TIME_TO_LIVE_MAX 2000u /* ms */

static uint16_t status;
static uint32_t deadline; /* schedule_now() at which the set-point in force ends */

void safety_start(void) {
  status = 0;
  motion_off();
}

bool safety_accept(uint16_t time_to_live) {
  if (time_to_live > TIME_TO_LIVE_MAX || !parameters_device_on(DEVICES_SERVOS)) {
    return false;
  }
  if (time_to_live == 0) {
    time_to_live = (uint16_t)parameters_get(PARAMETER_TIME_TO_LIVE_DEFAULT);
  }
  deadline = schedule_now() + (uint32_t)time_to_live * SCHEDULE_CYCLES_PER_MS;
  status = STATUS_MOTORS_ENABLED;
  return true;
}

void safety_stop(void) {
  status = STATUS_STOPPED;
  motion_off();
}

void safety_task(void) {
  if ((status & STATUS_MOTORS_ENABLED) == 0) {
    return;
  }
  if (!parameters_device_on(DEVICES_SERVOS)) {
    status = 0;
    motion_off();
  } else if ((int32_t)(schedule_now() - deadline) >= 0) {
    status = STATUS_DEAD_MAN;
    motion_off();
  }
}

uint16_t safety_status(void) { return status; }
