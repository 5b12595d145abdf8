/* firmware.c: start-up order and what one round of the main loop does. */
#include "firmware.h"

#include "analog.h"
#include "buzzer.h"
#include "compass.h"
#include "encoder.h"
#include "hal/hal.h"
#include "infrared.h"
#include "light.h"
#include "link/identity.h"
#include "link/link.h"
#include "link/parameters.h"
#include "motion.h"
#include "ping.h"
#include "reset.h"
#include "safety.h"
#include "schedule.h"
#include "servo.h"
#include "storage.h"
#include "supply.h"
#include "whisker.h"

void firmware_start(void) {
  reset_start();
  identity_start();
  storage_start();
  parameters_start();
  motion_use_parameters();
  servo_start();
  encoder_start();
  whisker_start();
  infrared_start();
  ping_start();
  supply_start();
  analog_start();
  light_start();
  compass_start();
  buzzer_start();
  schedule_start(0);
  safety_start();
  const uint16_t baud = parameters_u16(PARAMETER_BAUD_RATE); /* in 100 bit/s; a change counts from the next start on */
  hal_start_serial(baud);
  link_start(baud);
  hal_start_timers();
  buzzer_start_beep();
  hal_start_watchdog();
}

void firmware_poll(void) {
  if (schedule_waiting() != 0) {
    schedule_poll();
  } else if (encoder_due() != 0) {
    encoder_poll();
  } else {
    link_poll();
  }
}

bool firmware_due(void) { return schedule_waiting() != 0 || encoder_due() != 0 || link_due(); }
