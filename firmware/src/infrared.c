/* infrared.c: see infrared.h. */
#include "infrared.h"

#include <stdbool.h>

#include "generated/messages.h"
#include "hal/hal.h"
#include "link/parameters.h"
#include "pins.h"
#include "schedule.h"

#define BURST_CYCLES 16000u /* 1 ms */

/* Half a period in cycles: 37.91, 39.02, 40.00, 41.03, 42.11 kHz. */
#define BANDS 5u
static const uint8_t half_periods[BANDS] = {211, 205, 200, 195, 190};
#define AGE_NEVER 255u

/* Shared with the interrupts; single bytes. */
static volatile bool armed;    /* this tick shall have bursts */
static volatile bool finished; /* both sides were read since the last look */
static volatile uint8_t seen;  /* what the bursts of this tick found */
static volatile uint8_t band;  /* frequency of this tick's bursts; changed between ticks with bursts only */

/* Interrupts only. */
static bool started;   /* this tick's left burst was made: the right one follows */
static uint8_t active; /* the side whose LED is on */

/* Main loop only. */
static uint8_t reading;
static uint8_t age;
static uint8_t wait; /* ticks until the next reading */
static bool sweeping;
static uint8_t counts[SIDES]; /* frequencies of the sweep at which an object was seen so far, */
static uint8_t zones[SIDES];  /* and in the last whole one */
static uint8_t zone_age;

void infrared_start(void) {
  HAL_PIN_LOW(INFRARED_LEFT_LED);
  HAL_PIN_LOW(INFRARED_RIGHT_LED);
  HAL_PIN_OUTPUT(INFRARED_LEFT_LED);
  HAL_PIN_OUTPUT(INFRARED_RIGHT_LED);
  HAL_PIN_INPUT(INFRARED_LEFT_RECEIVER);
  HAL_PIN_INPUT(INFRARED_RIGHT_RECEIVER);
  HAL_ZERO(armed);
  HAL_ZERO(started);
  HAL_ZERO(finished);
  HAL_ZERO(seen);
  HAL_ZERO(reading);
  age = AGE_NEVER;
  HAL_ZERO(wait);
  HAL_ZERO(band);
  HAL_ZERO(sweeping);
  zone_age = AGE_NEVER;
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
  hal_carrier_start(side, half_periods[band]);
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

/* What a tick's bursts found: at 38 kHz the reading, in a sweep a part of the zones as well. */
static void take(void) {
  if (band == 0) {
    reading = seen;
    age = 0;
    counts[LEFT] = counts[RIGHT] = 0;
  }
  if (!sweeping) {
    return;
  }
  counts[LEFT] = (uint8_t)(counts[LEFT] + ((seen & INFRARED_LEFT) != 0));
  counts[RIGHT] = (uint8_t)(counts[RIGHT] + ((seen & INFRARED_RIGHT) != 0));
  band++;
  if (band == BANDS) {
    band = 0;
    zones[LEFT] = counts[LEFT];
    zones[RIGHT] = counts[RIGHT];
    zone_age = 0;
  }
}

static void forget_sweep(void) {
  sweeping = false;
  band = 0;
  zones[LEFT] = zones[RIGHT] = 0;
  zone_age = AGE_NEVER;
}

void infrared_task(void) {
  if (finished) {
    finished = false;
    take();
  }
  if (age < AGE_NEVER) {
    age++;
  }
  if (zone_age < AGE_NEVER) {
    zone_age++;
  }
  if (wait > 0) {
    wait--;
  }
  if (parameters_device_on(DEVICES_INFRARED)) {
    if (parameters_u16(PARAMETER_INFRARED_SWEEP) == 0) {
      forget_sweep();
    }
    if (band != 0) { /* the sweep goes on */
      armed = true;
    } else if (wait == 0) {
      sweeping = parameters_u16(PARAMETER_INFRARED_SWEEP) != 0;
      wait = (uint8_t)parameters_u16(PARAMETER_INFRARED_PERIOD);
      armed = true;
    }
  } else {
    armed = false;
    reading = 0;
    age = AGE_NEVER;
    forget_sweep();
  }
}

uint8_t infrared_zone(uint8_t side) { return zones[side]; }

uint8_t infrared_zone_age(void) { return zone_age; }

uint8_t infrared_read(void) { return reading; }

uint8_t infrared_age(void) { return age; }
