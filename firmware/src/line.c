/* line.c: see line.h. */
#include "line.h"

#include "clock.h"
#include "hal/hal.h"
#include "hal/interrupts.h"
#include "parameters.h"
#include "pins.h"
#include "tasks.h"

#if DEVICES_BUILT & DEVICES_LINE

_Static_assert(PIN_LINE_LEFT < 8 && PIN_LINE_MIDDLE < 8 && PIN_LINE_RIGHT < 8, "port D stamps their edges");

enum { SENSOR_LEFT, SENSOR_MIDDLE, SENSOR_RIGHT, SENSORS };
enum { CHARGE = 7, RELEASE = 0, COLLECT = 6 }; /* slots of a servo frame */

#define LONGEST MSG_LINE_TELEMETRY_LINE_LEFT_MAX /* us */

static enum { IDLE, CHARGING, DECAYING } state;
static uint32_t released;                /* clock_now() */
static volatile uint32_t edges[SENSORS]; /* the same of each fall */
static volatile bool has_fallen[SENSORS];
static uint16_t readings[SENSORS]; /* us; 0: none */
static uint8_t age;                /* ticks */

static void let_go(void) {
  hal_watch_port_d(0);
  HAL_PIN_PULL_UP(LINE_LEFT);
  HAL_PIN_PULL_UP(LINE_MIDDLE);
  HAL_PIN_PULL_UP(LINE_RIGHT);
  state = IDLE;
}

static void forget(void) {
  readings[SENSOR_LEFT] = readings[SENSOR_MIDDLE] = readings[SENSOR_RIGHT] = 0;
  age = AGE_NEVER;
}

void line_start(void) {
  let_go();
  forget();
}

static void charge(void) {
  HAL_PIN_OUTPUT_HIGH(LINE_LEFT);
  HAL_PIN_OUTPUT_HIGH(LINE_MIDDLE);
  HAL_PIN_OUTPUT_HIGH(LINE_RIGHT);
  has_fallen[SENSOR_LEFT] = has_fallen[SENSOR_MIDDLE] = has_fallen[SENSOR_RIGHT] = false;
  state = CHARGING;
}

/* Inputs without pull-up: nothing flows but through the phototransistors. */
static void release(void) {
  hal_watch_port_d(HAL_PIN_BIT(LINE_LEFT) | HAL_PIN_BIT(LINE_MIDDLE) | HAL_PIN_BIT(LINE_RIGHT));
  HAL_ATOMIC {
    HAL_PIN_INPUT(LINE_LEFT);
    HAL_PIN_INPUT(LINE_MIDDLE);
    HAL_PIN_INPUT(LINE_RIGHT);
    released = clock_now();
  }
  state = DECAYING;
}

static void stamp(uint8_t sensor, uint8_t level, uint32_t time) {
  if (level == 0 && !has_fallen[sensor]) {
    edges[sensor] = time;
    has_fallen[sensor] = true;
  }
}

void port_d_on_change(uint16_t time) {
  const uint32_t now = clock_cycles_at(time);
  stamp(SENSOR_LEFT, HAL_PIN_READ(LINE_LEFT), now);
  stamp(SENSOR_MIDDLE, HAL_PIN_READ(LINE_MIDDLE), now);
  stamp(SENSOR_RIGHT, HAL_PIN_READ(LINE_RIGHT), now);
}

/* Decay time in us. Without an edge the line is still high, or it is low and the edge was not seen. */
static uint16_t decay_time(uint8_t sensor, uint8_t level) {
  if (!has_fallen[sensor]) {
    return level != 0 ? LONGEST : 0u;
  }
  const uint32_t us = (edges[sensor] - released) / HAL_CYCLES_PER_US;
  return us == 0 ? 1u : us > LONGEST ? LONGEST : (uint16_t)us;
}

static void collect(void) {
  readings[SENSOR_LEFT] = decay_time(SENSOR_LEFT, HAL_PIN_READ(LINE_LEFT));
  readings[SENSOR_MIDDLE] = decay_time(SENSOR_MIDDLE, HAL_PIN_READ(LINE_MIDDLE));
  readings[SENSOR_RIGHT] = decay_time(SENSOR_RIGHT, HAL_PIN_READ(LINE_RIGHT));
  age = 0;
  let_go();
}

/* In every slot. A line that is still high may fall until the longest decay is over. */
void line_task(void) {
  const uint8_t slot = clock_frame_slot();
  if (clock_tick_begins()) {
    clock_grow_older(&age);
  }
  const bool is_over = state == DECAYING && clock_now() - released >= LONGEST * (uint32_t)HAL_CYCLES_PER_US;
  if (!parameters_device_in_use(DEVICES_LINE)) {
    if (state != IDLE) {
      let_go();
    }
    forget();
  } else if (slot == CHARGE) {
    if (is_over) { /* it had to wait */
      collect();
    }
    charge();
  } else if (slot == RELEASE && state == CHARGING) {
    release();
  } else if (slot == COLLECT && is_over) {
    collect();
  }
}

bool line_report_line_telemetry(msg_line_telemetry *message) {
  message->line_left = readings[SENSOR_LEFT];
  message->line_middle = readings[SENSOR_MIDDLE];
  message->line_right = readings[SENSOR_RIGHT];
  message->line_age = age;
  return parameters_device_on(DEVICES_LINE);
}

#endif
