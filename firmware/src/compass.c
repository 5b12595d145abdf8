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
static uint8_t state;
static bool is_set;    /* the device has its settings */
static uint8_t wait;   /* ticks until the next transfer */
static uint8_t pulses; /* of the clock, twice: low and high again */
static compass_reading reading;

static void forget(uint8_t status) {
  reading = (compass_reading){.age = AGE_NEVER, .status = status};
  is_set = false;
}

void compass_start(void) {
  HAL_PIN_PULL_UP(COMPASS_SDA);
  HAL_PIN_PULL_UP(COMPASS_SCL);
  state = OFF;
  wait = 0;
  forget(COMPASS_STATUS_OFF);
}

static int16_t word(const uint8_t *bytes) { return (int16_t)(uint16_t)((uint16_t)bytes[0] << 8 | bytes[1]); }

static void take(void) {
  const uint8_t *bytes = two_wire_bytes();
  reading.x = word(bytes);
  reading.z = word(bytes + 2);
  reading.y = word(bytes + 4);
  reading.age = 0;
  reading.status = COMPASS_STATUS_OK;
}

static void begin(void) {
  if (is_set) {
    state = READING;
    two_wire_begin(ADDRESS, data_register, sizeof data_register, DATA_BYTES);
  } else {
    state = SETTING;
    two_wire_begin(ADDRESS, settings, sizeof settings, 0);
  }
}

/* A transfer was begun in the tick before: it takes 1 ms. */
static void finish(void) {
  switch (two_wire_ended()) {
    case TWO_WIRE_OK:
      if (state == READING) {
        take();
      }
      is_set = true;
      break;
    case TWO_WIRE_NO_ANSWER:
      reading.status = COMPASS_STATUS_NO_ANSWER;
      is_set = false;
      break;
    case TWO_WIRE_FAILED:
      reading.status = COMPASS_STATUS_FAILED;
      is_set = false;
      break;
    default:
      two_wire_stop();
      reading.status = COMPASS_STATUS_BUS_STUCK;
      is_set = false;
      pulses = 0;
      state = FREEING;
      return;
  }
  state = WAITING;
}

/* One edge of the clock a tick, low or let go, until the data line is free after a pulse, or after all of them. */
static void free_bus(void) {
  if (pulses % 2u == 0) {
    if (pulses == 2u * CLOCK_PULSES || (pulses != 0 && HAL_PIN_READ(COMPASS_SDA) != 0)) {
      two_wire_start();
      state = WAITING;
      return;
    }
    HAL_PIN_LOW(COMPASS_SCL);
    HAL_PIN_OUTPUT(COMPASS_SCL);
  } else {
    HAL_PIN_PULL_UP(COMPASS_SCL);
  }
  pulses++;
}

static void switch_off(void) {
  if (state != OFF) {
    two_wire_stop();
    compass_start();
  }
}

void compass_task(void) {
  if (reading.age < AGE_NEVER) {
    reading.age++;
  }
  if (wait > 0) {
    wait--;
  }
  if (!parameters_device_on(DEVICES_COMPASS)) {
    switch_off();
    return;
  }
  switch (state) {
    case OFF:
      two_wire_start();
      state = WAITING;
      break;
    case SETTING:
    case READING:
      finish();
      break;
    case FREEING:
      free_bus();
      break;
    default:
      break;
  }
  if (state == WAITING && wait == 0) {
    wait = PERIOD;
    begin();
  }
}

const compass_reading *compass_read(void) { return &reading; }
