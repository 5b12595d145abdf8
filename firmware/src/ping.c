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

typedef struct {
  uint16_t echo;
  uint8_t age;
  uint8_t since_trigger; /* ticks, saturating */
} ping_state;

static ping_state own;             /* the main loop's only */
static volatile uint8_t state;     /* shared with the capture interrupt */
static schedule_moment rise, fall; /* its stamps, settled when the state is ENDED */

void ping_start(void) {
  ping_state *const self = HAL_NEAR(&own);
  HAL_PIN_INPUT(PING);
  hal_capture_stop();
  HAL_ZERO(state);
  HAL_ZERO(self->echo);
  self->age = AGE_NEVER;
  self->since_trigger = 255;
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
  ping_state *const self = HAL_NEAR(&own);
  if (self->age < AGE_NEVER) {
    self->age++;
  }
  if (state == ENDED) {
    state = IDLE;
    self->echo =
        (uint16_t)((uint32_t)(schedule_between(rise, fall) + (int32_t)HAL_CYCLES_PER_US / 2) / HAL_CYCLES_PER_US);
    if (self->echo < ECHO_MIN) {
      self->echo = 0;
    }
    /* Whole ticks between the tick in which it ended and this one. */
    self->age = (uint8_t)((uint8_t)((uint8_t)schedule_tick() - fall.slot / SCHEDULE_SLOTS_PER_TICK) % 64u);
  }
  if (!parameters_device_on(DEVICES_PING)) {
    self->echo = 0;
    self->age = AGE_NEVER;
  }
}

void ping_task(void) {
  ping_state *const self = HAL_NEAR(&own);
  if (self->since_trigger < 255u) {
    self->since_trigger++;
  }
  if ((state == RISING || state == FALLING) && self->since_trigger >= GIVE_UP_TICKS) {
    HAL_ATOMIC {
      if (state != ENDED) {
        hal_capture_stop();
        state = IDLE;
        self->echo = 0;
        self->age = 0;
      }
    }
  }
  if (state == IDLE && parameters_device_on(DEVICES_PING) &&
      self->since_trigger >= (uint8_t)parameters_u16(PARAMETER_PING_PERIOD)) {
    self->since_trigger = 0;
    state = RISING;
    hal_ping_trigger();
  }
}

uint16_t ping_echo(void) { return own.echo; }

uint8_t ping_age(void) { return own.age; }
