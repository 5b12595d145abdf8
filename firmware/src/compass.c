/* compass.c: see compass.h. */
#include "compass.h"

#include "clock.h"
#include "generated/values.h"
#include "hal/hal.h"
#include "parameters.h"
#include "tasks.h"
#include "two_wire.h"

#define ADDRESS 0x1Eu
#define PERIOD 4u       /* ticks */
#define CLOCK_PULSES 9u /* a byte and its acknowledgement: no device holds the data line longer */

/* Registers 0 to 2: 8 samples, 75 Hz; range 1.3 Ga; continuous. */
static const uint8_t settings[] = {0, 0x78, 0x20, 0x00};
static const uint8_t data_register[] = {3}; /* x, z, y, the high byte first */
#define DATA_BYTES 6u

_Static_assert(sizeof settings <= TWO_WIRE_WRITE_MAX && DATA_BYTES <= TWO_WIRE_READ_MAX, "a transfer has room");

enum { OFF, WAITING, SETTING, READING, FREEING };

typedef struct {
  int16_t x, y, z; /* raw counts; -4096: overflow */
  uint8_t age;     /* ticks since they were read; 255: never or older */
  uint8_t status;  /* COMPASS_STATUS_... */
} compass_reading;

typedef struct {
  uint8_t state;
  bool is_set;   /* the device has its settings */
  uint8_t wait;  /* ticks until the next transfer */
  uint8_t edges; /* of the clock's pulses that free the bus, down and up again */
  compass_reading reading;
} compass_state;

static compass_state own;

static void forget(uint8_t status) {
  own.reading = (compass_reading){.age = AGE_NEVER, .status = status};
  own.is_set = false;
}

void compass_start(void) {
  HAL_PIN_PULL_UP(COMPASS_SDA);
  HAL_PIN_PULL_UP(COMPASS_SCL);
  own.state = OFF;
  own.wait = 0;
  forget(COMPASS_STATUS_OFF);
}

static int16_t word(const volatile uint8_t *bytes) { return (int16_t)(uint16_t)((uint16_t)bytes[0] << 8 | bytes[1]); }

static void take(void) {
  const volatile uint8_t *bytes = two_wire_bytes();
  own.reading.x = word(bytes);
  own.reading.z = word(bytes + 2);
  own.reading.y = word(bytes + 4);
  own.reading.age = 0;
  own.reading.status = COMPASS_STATUS_OK;
}

static void begin(void) {
  if (own.is_set) {
    own.state = READING;
    two_wire_begin(ADDRESS, data_register, sizeof data_register, DATA_BYTES);
  } else {
    own.state = SETTING;
    two_wire_begin(ADDRESS, settings, sizeof settings, 0);
  }
}

/* A transfer was begun in the tick before: it takes 1 ms. */
static void finish(void) {
  switch (two_wire_ended()) {
    case TWO_WIRE_OK:
      if (own.state == READING) {
        take();
      }
      own.is_set = true;
      break;
    case TWO_WIRE_NO_ANSWER:
      own.reading.status = COMPASS_STATUS_NO_ANSWER;
      own.is_set = false;
      break;
    case TWO_WIRE_FAILED:
      own.reading.status = COMPASS_STATUS_FAILED;
      own.is_set = false;
      break;
    default:
      two_wire_stop();
      own.reading.status = COMPASS_STATUS_BUS_STUCK;
      own.is_set = false;
      own.edges = 0;
      own.state = FREEING;
      return;
  }
  own.state = WAITING;
}

/* One edge of the clock a tick, low or let go, until the data line is free after a pulse, or after all of them. */
static void free_bus(void) {
  if (own.edges % 2u == 0) {
    if (own.edges == 2u * CLOCK_PULSES || (own.edges != 0 && HAL_PIN_READ(COMPASS_SDA) != 0)) {
      two_wire_start();
      own.state = WAITING;
      return;
    }
    HAL_PIN_OUTPUT_LOW(COMPASS_SCL);
  } else {
    HAL_PIN_PULL_UP(COMPASS_SCL);
  }
  own.edges++;
}

static void switch_off(void) {
  if (own.state != OFF) {
    two_wire_stop();
    compass_start();
  }
}

/* Once per tick. */
void compass_task(void) {
  clock_grow_older(&own.reading.age);
  if (own.wait > 0) {
    own.wait--;
  }
  if (!parameters_device_in_use(DEVICES_COMPASS)) {
    switch_off();
    return;
  }
  switch (own.state) {
    case OFF:
      two_wire_start();
      own.state = WAITING;
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
  if (own.state == WAITING && own.wait == 0) {
    own.wait = PERIOD;
    begin();
  }
}

bool compass_report_devices_telemetry(msg_devices_telemetry *message) {
  message->compass_x = own.reading.x;
  message->compass_y = own.reading.y;
  message->compass_z = own.reading.z;
  message->compass_age = own.reading.age;
  message->compass_status = own.reading.status;
  return parameters_device_on(DEVICES_COMPASS);
}
