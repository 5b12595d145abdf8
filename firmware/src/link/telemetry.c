/* telemetry.c: see telemetry.h. */
#include "link/telemetry.h"

#include "encoder.h"
#include "generated/messages.h"
#include "hal/hal.h"
#include "infrared.h"
#include "link/dispatch.h"
#include "link/link.h"
#include "link/send.h"
#include "ping.h"
#include "pins.h"
#include "safety.h"
#include "schedule.h"
#include "servo.h"
#include "whisker.h"

static uint16_t status_bits(const encoder_reading *left, const encoder_reading *right) {
  uint16_t status = safety_status();
  if (left->masked) {
    status |= STATUS_ENCODER_LEFT_MASKED;
  }
  if (right->masked) {
    status |= STATUS_ENCODER_RIGHT_MASKED;
  }
  if (schedule_overran()) {
    status |= STATUS_TICK_OVERRUN;
  }
  if (hal_serial_overrun()) {
    status |= STATUS_RECEIVE_OVERRUN;
  }
  if (hal_reset_cause() == RESET_CAUSE_WATCHDOG) {
    status |= STATUS_WATCHDOG_RESET;
  }
  return status;
}

void telemetry_task(void) {
  const encoder_reading *left = encoder_read(LEFT);
  const encoder_reading *right = encoder_read(RIGHT);
  ping_collect();
  const msg_telemetry telemetry = {
      .tick = schedule_tick(),
      .time = schedule_tick() * SCHEDULE_TICK_US,
      .encoder_left = left->count,
      .encoder_right = right->count,
      .edge_period_left = left->period,
      .edge_period_right = right->period,
      .whiskers = whisker_read(),
      .infrared = infrared_read(),
      .infrared_age = infrared_age(),
      .ping_echo = ping_echo(),
      .ping_age = ping_age(),
      .pulse_left = servo_pulse(LEFT),
      .pulse_right = servo_pulse(RIGHT),
      .status = status_bits(left, right),
      .setpoint_sequence = dispatch_setpoint_sequence(),
      .frames_bad = link_frames_bad(),
      .overruns = schedule_overruns(),
  };
  send_message(MSG_TELEMETRY_ID, &telemetry, sizeof telemetry);
}
