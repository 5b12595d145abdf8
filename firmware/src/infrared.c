/* infrared.c: see infrared.h. */
#include "infrared.h"

#include <stdbool.h>

#include "generated/messages.h"
#include "hal/hal.h"
#include "link/parameters.h"
#include "pins.h"
#include "schedule.h"

#define BURST_CYCLES 16000u /* 1 ms */
#define AGE_NEVER 255u

/* Shared with the interrupts; single bytes. */
static volatile bool armed;    /* this tick shall have bursts */
static volatile bool finished; /* both sides were read since the last look */
static volatile uint8_t seen;  /* what the bursts of this tick found */

/* Interrupts only. */
static bool started;   /* this tick's left burst was made: the right one follows */
static uint8_t active; /* the side whose LED is on */

/* Main loop only. */
static uint8_t reading;
static uint8_t age;
static uint8_t wait; /* ticks until the next reading */

void infrared_start(void) {
  HAL_PIN_LOW(INFRARED_LEFT_LED);
  HAL_PIN_LOW(INFRARED_RIGHT_LED);
  HAL_PIN_OUTPUT(INFRARED_LEFT_LED);
  HAL_PIN_OUTPUT(INFRARED_RIGHT_LED);
  HAL_PIN_INPUT(INFRARED_LEFT_RECEIVER);
  HAL_PIN_INPUT(INFRARED_RIGHT_RECEIVER);
  armed = started = finished = false;
  seen = 0;
  reading = 0;
  age = AGE_NEVER;
  wait = 0;
}

void infrared_begin(uint8_t side, uint16_t start) {
  if (side == LEFT) {
    started = armed;
    armed = false;
  }
  if (!started) {
    return;
  }
  active = side;
  hal_carrier_start(side);
  hal_edge_arm_plain((uint16_t)(start + BURST_CYCLES));
}

void infrared_end(void) {
  hal_edge_disarm();
  if (active == LEFT) {
    seen = HAL_PIN_READ(INFRARED_LEFT_RECEIVER) == 0 ? (uint8_t)INFRARED_LEFT : 0u;
    hal_carrier_stop();
  } else {
    if (HAL_PIN_READ(INFRARED_RIGHT_RECEIVER) == 0) {
      seen |= (uint8_t)INFRARED_RIGHT;
    }
    hal_carrier_stop();
    finished = true;
  }
}

void infrared_task(void) {
  if (finished) {
    finished = false;
    reading = seen;
    age = 0;
  }
  if (age < AGE_NEVER) {
    age++;
  }
  if (wait > 0) {
    wait--;
  }
  if (parameters_device_on(DEVICES_INFRARED)) {
    if (wait == 0) {
      wait = (uint8_t)parameters_u16(PARAMETER_INFRARED_PERIOD);
      armed = true;
    }
  } else {
    armed = false;
    reading = 0;
    age = AGE_NEVER;
  }
}

uint8_t infrared_read(void) { return reading; }

uint8_t infrared_age(void) { return age; }
