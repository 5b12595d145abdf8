/* firmware.c: start-up order and what one round of the main loop does. */
#include "firmware.h"

#include "analog.h"
#include "buzzer.h"
#include "clock.h"
#include "events.h"
#include "fallback.h"
#include "generated/devices.h"
#include "hal/hal.h"
#include "link/identity.h"
#include "link/link.h"
#include "link/receive.h"
#include "parameters.h"
#include "pin_changes.h"
#include "reset.h"
#include "safety.h"
#include "schedule.h"
#include "storage.h"
#include "supply.h"

/* First the pins, so that no servo moves by a floating line; the image's hash, which takes 0.17 s, comes after them. */
void firmware_start(void) {
  devices_start();
  HAL_PIN_PULL_UP(UART_RECEIVE); /* the line is high while nobody speaks */
  HAL_PIN_PULL_UP(UART_TRANSMIT);
  reset_start();
  storage_start();
  parameters_start();
  storage_load_parameters();
  events_start();
  pin_changes_start();
  supply_start();
  analog_start();
  schedule_start(0);
  safety_start();
  fallback_start();
  identity_start();
  const uint16_t baud = parameters_u16(PARAMETER_BAUD_RATE); /* in 100 bit/s; a change counts from the next start on */
  hal_start_serial(baud);
  link_start(baud);
  hal_start_timers();
  buzzer_start_beep();
  hal_start_watchdog();
}

void firmware_poll(void) {
  if (clock_waiting() != 0) {
    schedule_poll();
    return;
  }
  pin_changes_poll();
  link_poll();
}

/* Asked after each interrupt that ends the sleep, so it is quick. */
uint8_t firmware_due(void) { return clock_waiting() | pin_changes_due() | receive_due(); }
