/* ping.c: see ping.h. */
#include "ping.h"

#include <stdbool.h>

#include "generated/messages.h"
#include "hal/hal.h"
#include "link/parameters.h"
#include "pins.h"
#include "schedule.h"

_Static_assert(PIN_PING == 8, "the timer captures on pin 8");

#define GIVE_UP_TICKS 2u /* 20 ms after the trigger */
#define AGE_NEVER 255u
#define ECHO_MIN 100u /* us; the sensor's shortest echo is 115 us, what is shorter is noise */

enum { IDLE, RISING, FALLING, ENDED }; /* what is awaited */

/* Shared with the capture interrupt. `rise` and `fall` are settled when `state` is ENDED. */
static volatile uint8_t state;
static schedule_moment rise, fall;

/* Main loop only. */
static uint16_t echo;
static uint8_t age;
static uint8_t since_trigger; /* ticks, saturating */

void ping_start(void) {
  HAL_PIN_INPUT(PING);
  hal_capture_stop();
  HAL_ZERO(state);
  HAL_ZERO(echo);
  age = AGE_NEVER;
  since_trigger = 255;
}

HAL_INTERRUPT_CAPTURE {
  const schedule_moment now = schedule_moment_at(hal_capture_time());
  if (state == RISING) {
    rise = now;
    state = FALLING;
    hal_capture_falling();
  } else {
    fall = now;
    state = ENDED;
    hal_capture_stop();
  }
  hal_serial_look();
}

void ping_collect(void) {
  if (age < AGE_NEVER) {
    age++;
  }
  if (state == ENDED) {
    state = IDLE;
    echo = (uint16_t)((uint32_t)(schedule_between(rise, fall) + (int32_t)HAL_CYCLES_PER_US / 2) / HAL_CYCLES_PER_US);
    if (echo < ECHO_MIN) {
      echo = 0;
    }
    /* Whole ticks between the tick in which it ended and this one. */
    age = (uint8_t)((uint8_t)((uint8_t)schedule_tick() - fall.slot / SCHEDULE_SLOTS_PER_TICK) % 64u);
  }
  if (!parameters_device_on(DEVICES_PING)) {
    echo = 0;
    age = AGE_NEVER;
  }
}

void ping_task(void) {
  if (since_trigger < 255u) {
    since_trigger++;
  }
  if ((state == RISING || state == FALLING) && since_trigger >= GIVE_UP_TICKS) {
    HAL_ATOMIC {
      if (state != ENDED) {
        hal_capture_stop();
        state = IDLE;
        echo = 0;
        age = 0;
      }
    }
  }
  if (state == IDLE && parameters_device_on(DEVICES_PING) &&
      since_trigger >= (uint8_t)parameters_u16(PARAMETER_PING_PERIOD)) {
    since_trigger = 0;
    state = RISING;
    hal_ping_trigger();
  }
}

uint16_t ping_echo(void) { return echo; }

uint8_t ping_age(void) { return age; }
