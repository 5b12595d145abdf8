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

typedef struct {
  /* Shared with the interrupts; single bytes. */
  volatile bool armed;    /* this tick shall have bursts */
  volatile bool finished; /* both sides were read since the last look */
  volatile uint8_t seen;  /* what the bursts of this tick found */
  volatile uint8_t band;  /* frequency of this tick's bursts; changed between ticks with bursts only */

  /* Interrupts only. */
  bool started;   /* this tick's left burst was made: the right one follows */
  uint8_t active; /* the side whose LED is on */

  /* Main loop only. */
  uint8_t reading;
  uint8_t age;
  uint8_t wait; /* ticks until the next reading */
  bool sweeping;
  uint8_t counts[SIDES]; /* frequencies of the sweep at which an object was seen so far, */
  uint8_t zones[SIDES];  /* and in the last whole one */
  uint8_t zone_age;
} infrared_state;

static infrared_state own;

void infrared_start(void) {
  HAL_PIN_LOW(INFRARED_LEFT_LED);
  HAL_PIN_LOW(INFRARED_RIGHT_LED);
  HAL_PIN_OUTPUT(INFRARED_LEFT_LED);
  HAL_PIN_OUTPUT(INFRARED_RIGHT_LED);
  HAL_PIN_INPUT(INFRARED_LEFT_RECEIVER);
  HAL_PIN_INPUT(INFRARED_RIGHT_RECEIVER);
  HAL_ZERO(own.armed);
  HAL_ZERO(own.started);
  HAL_ZERO(own.finished);
  HAL_ZERO(own.seen);
  HAL_ZERO(own.reading);
  own.age = AGE_NEVER;
  HAL_ZERO(own.wait);
  HAL_ZERO(own.band);
  HAL_ZERO(own.sweeping);
  own.zone_age = AGE_NEVER;
}

void infrared_begin(uint8_t side, uint16_t start) {
  if (side == LEFT) {
    own.started = own.armed;
    own.armed = false;
  }
  if (!own.started) {
    return;
  }
  own.active = side;
  hal_carrier_start(side, half_periods[own.band]);
  hal_edge_arm_plain((uint16_t)(start + BURST_CYCLES));
}

void infrared_end(void) {
  hal_edge_disarm();
  if (own.active == LEFT) {
    own.seen = HAL_PIN_READ(INFRARED_LEFT_RECEIVER) == 0 ? (uint8_t)INFRARED_LEFT : 0u;
    hal_carrier_stop();
  } else {
    if (HAL_PIN_READ(INFRARED_RIGHT_RECEIVER) == 0) {
      own.seen |= (uint8_t)INFRARED_RIGHT;
    }
    hal_carrier_stop();
    own.finished = true;
  }
}

/* What a tick's bursts found: at 38 kHz the reading, in a sweep a part of the zones as well. */
static void take(infrared_state *self) {
  if (self->band == 0) {
    self->reading = self->seen;
    self->age = 0;
    self->counts[LEFT] = self->counts[RIGHT] = 0;
  }
  if (!self->sweeping) {
    return;
  }
  self->counts[LEFT] = (uint8_t)(self->counts[LEFT] + ((self->seen & INFRARED_LEFT) != 0));
  self->counts[RIGHT] = (uint8_t)(self->counts[RIGHT] + ((self->seen & INFRARED_RIGHT) != 0));
  self->band++;
  if (self->band == BANDS) {
    self->band = 0;
    self->zones[LEFT] = self->counts[LEFT];
    self->zones[RIGHT] = self->counts[RIGHT];
    self->zone_age = 0;
  }
}

static void forget_sweep(infrared_state *self) {
  self->sweeping = false;
  self->band = 0;
  self->zones[LEFT] = self->zones[RIGHT] = 0;
  self->zone_age = AGE_NEVER;
}

void infrared_task(void) {
  infrared_state *const self = HAL_NEAR(&own);
  if (self->finished) {
    self->finished = false;
    take(self);
  }
  if (self->age < AGE_NEVER) {
    self->age++;
  }
  if (self->zone_age < AGE_NEVER) {
    self->zone_age++;
  }
  if (self->wait > 0) {
    self->wait--;
  }
  if (parameters_device_on(DEVICES_INFRARED)) {
    if (parameters_u16(PARAMETER_INFRARED_SWEEP) == 0) {
      forget_sweep(self);
    }
    if (self->band != 0) { /* the sweep goes on */
      self->armed = true;
    } else if (self->wait == 0) {
      self->sweeping = parameters_u16(PARAMETER_INFRARED_SWEEP) != 0;
      self->wait = (uint8_t)parameters_u16(PARAMETER_INFRARED_PERIOD);
      self->armed = true;
    }
  } else {
    self->armed = false;
    self->reading = 0;
    self->age = AGE_NEVER;
    forget_sweep(self);
  }
}

uint8_t infrared_zone(uint8_t side) { return own.zones[side]; }

uint8_t infrared_zone_age(void) { return own.zone_age; }

uint8_t infrared_read(void) { return own.reading; }

uint8_t infrared_age(void) { return own.age; }
