/* compass.c: see compass.h. */
#include "compass.h"

#include <stdbool.h>

#include "generated/messages.h"
#include "hal/hal.h"
#include "link/parameters.h"
#include "pins.h"
#include "two_wire.h"

#define ADDRESS 0x1Eu
#define AGE_NEVER 255u
#define PERIOD 4u       /* ticks */
#define CLOCK_PULSES 9u /* a byte and its acknowledgement: no device holds the data line longer */

/* Registers 0 to 2: 8 samples, 75 Hz; range 1.3 Ga; continuous. */
static const uint8_t settings[] = {0, 0x78, 0x20, 0x00};
static const uint8_t data_register[] = {3}; /* x, z, y, the high byte first */
#define DATA_BYTES 6u

_Static_assert(sizeof settings <= TWO_WIRE_WRITE_MAX && DATA_BYTES <= TWO_WIRE_READ_MAX, "a transfer has room");

enum { OFF, WAITING, SETTING, READING, FREEING };

typedef struct {
  uint8_t state;
  bool is_set;    /* the device has its settings */
  uint8_t wait;   /* ticks until the next transfer */
  uint8_t pulses; /* of the clock, twice: low and high again */
  compass_reading reading;
} compass_state;

static compass_state own;

static void forget(compass_state *self, uint8_t status) {
  self->reading = (compass_reading){.age = AGE_NEVER, .status = status};
  self->is_set = false;
}

void compass_start(void) {
  compass_state *const self = HAL_NEAR(&own);
  HAL_PIN_PULL_UP(COMPASS_SDA);
  HAL_PIN_PULL_UP(COMPASS_SCL);
  self->state = OFF;
  self->wait = 0;
  forget(self, COMPASS_STATUS_OFF);
}

static int16_t word(const uint8_t *bytes) { return (int16_t)(uint16_t)((uint16_t)bytes[0] << 8 | bytes[1]); }

static void take(compass_state *self) {
  const uint8_t *bytes = two_wire_bytes();
  self->reading.x = word(bytes);
  self->reading.z = word(bytes + 2);
  self->reading.y = word(bytes + 4);
  self->reading.age = 0;
  self->reading.status = COMPASS_STATUS_OK;
}

static void begin(compass_state *self) {
  if (self->is_set) {
    self->state = READING;
    two_wire_begin(ADDRESS, data_register, sizeof data_register, DATA_BYTES);
  } else {
    self->state = SETTING;
    two_wire_begin(ADDRESS, settings, sizeof settings, 0);
  }
}

/* A transfer was begun in the tick before: it takes 1 ms. */
static void finish(compass_state *self) {
  switch (two_wire_ended()) {
    case TWO_WIRE_OK:
      if (self->state == READING) {
        take(self);
      }
      self->is_set = true;
      break;
    case TWO_WIRE_NO_ANSWER:
      self->reading.status = COMPASS_STATUS_NO_ANSWER;
      self->is_set = false;
      break;
    case TWO_WIRE_FAILED:
      self->reading.status = COMPASS_STATUS_FAILED;
      self->is_set = false;
      break;
    default:
      two_wire_stop();
      self->reading.status = COMPASS_STATUS_BUS_STUCK;
      self->is_set = false;
      self->pulses = 0;
      self->state = FREEING;
      return;
  }
  self->state = WAITING;
}

/* One edge of the clock a tick, low or let go, until the data line is free after a pulse, or after all of them. */
static void free_bus(compass_state *self) {
  if (self->pulses % 2u == 0) {
    if (self->pulses == 2u * CLOCK_PULSES || (self->pulses != 0 && HAL_PIN_READ(COMPASS_SDA) != 0)) {
      two_wire_start();
      self->state = WAITING;
      return;
    }
    HAL_PIN_LOW(COMPASS_SCL);
    HAL_PIN_OUTPUT(COMPASS_SCL);
  } else {
    HAL_PIN_PULL_UP(COMPASS_SCL);
  }
  self->pulses++;
}

static void switch_off(compass_state *self) {
  if (self->state != OFF) {
    two_wire_stop();
    compass_start();
  }
}

void compass_task(void) {
  compass_state *const self = HAL_NEAR(&own);
  if (self->reading.age < AGE_NEVER) {
    self->reading.age++;
  }
  if (self->wait > 0) {
    self->wait--;
  }
  if (!parameters_device_on(DEVICES_COMPASS)) {
    switch_off(self);
    return;
  }
  switch (self->state) {
    case OFF:
      two_wire_start();
      self->state = WAITING;
      break;
    case SETTING:
    case READING:
      finish(self);
      break;
    case FREEING:
      free_bus(self);
      break;
    default:
      break;
  }
  if (self->state == WAITING && self->wait == 0) {
    self->wait = PERIOD;
    begin(self);
  }
}

const compass_reading *compass_read(void) { return &own.reading; }
