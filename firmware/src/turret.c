/* turret.c: see turret.h. */
#include "turret.h"

#include "generated/values.h"
#include "motion.h"
#include "parameters.h"
#include "servo.h"
#include "tasks.h"

#define RADIAN 10000 /* in the angle's unit */

static bool is_connected;

/* Drives the servo's line, or lets go of it; in a frame with a pulse the line stays as it is. */
static void connect(bool connected) {
  if (connected != is_connected && servo_pulse(SERVO_TURRET) == 0) {
    is_connected = connected;
    servo_connect_turret(connected);
  }
}

void turret_hold(int16_t angle) {
  const int32_t pulse = (int32_t)parameters_u16(PARAMETER_TURRET_CENTRE) +
                        motion_offset(parameters_i16(PARAMETER_TURRET_GAIN), angle, RADIAN);
  connect(true); /* the task may come after the first pulse */
  servo_turn(pulse < (int32_t)SERVO_TURRET_MIN   ? SERVO_TURRET_MIN
             : pulse > (int32_t)SERVO_TURRET_MAX ? SERVO_TURRET_MAX
                                                 : (uint16_t)pulse);
}

void turret_release(void) { servo_turn(0); }

void turret_start(void) { is_connected = false; }

/* Once per servo frame: releases a turret that was switched off, and its pin after the last pulse. */
void turret_task(void) {
  const bool in_use = parameters_device_in_use(DEVICES_TURRET);
  if (!in_use) {
    turret_release();
  }
  connect(in_use);
}

bool turret_report_devices_telemetry(msg_devices_telemetry *message) {
  message->turret_pulse = servo_pulse(SERVO_TURRET);
  return parameters_device_on(DEVICES_TURRET);
}
