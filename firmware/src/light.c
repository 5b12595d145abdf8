/* light.c: see light.h. */
#include "light.h"

#include "clock.h"
#include "generated/values.h"
#include "hal/hal.h"
#include "hal/interrupts.h"
#include "parameters.h"
#include "pins.h"
#include "tasks.h"

#if defined(PIN_LIGHT_LEFT) && !defined(LIGHT_LEFT_IS_CAPTURED)
#define LEFT_BIT HAL_PIN_BIT(LIGHT_LEFT)
_Static_assert(PIN_LIGHT_LEFT >= 14, "the left light sensor's edge is stamped with the encoders', on port C");
#else
#define LEFT_BIT ((uint8_t)0) /* none, or the timer captures its edge */
#endif
#ifdef PIN_LIGHT_RIGHT
_Static_assert(PIN_LIGHT_RIGHT < 8, "the right light sensor's edge is stamped by port D");
#endif

enum { CHARGE = 7, RELEASE = 0, COLLECT = 6 }; /* slots of a servo frame */
_Static_assert(
    (COLLECT - RELEASE) * (uint32_t)HAL_SLOT_CYCLES >= (LIGHT_LONGEST + 1000u) * (uint32_t)HAL_CYCLES_PER_US,
    "the longest decay ends before the slot that collects, if the release is at most 1 ms late; else slot 7 collects");

static enum { IDLE, CHARGING, DECAYING } state;
static uint32_t released[SIDES];      /* clock_now() */
static volatile uint32_t edge[SIDES]; /* the same of the fall */
static volatile bool has_fallen[SIDES];
static uint16_t readings[SIDES];
static uint8_t age;

static void let_go(void) {
#ifdef PIN_LIGHT_RIGHT
  hal_watch_port_d(0);
  HAL_PIN_PULL_UP(LIGHT_RIGHT);
#endif
#ifdef LIGHT_LEFT_IS_CAPTURED
  hal_capture_stop();
#endif
#ifdef PIN_LIGHT_LEFT
  HAL_PIN_PULL_UP(LIGHT_LEFT);
#endif
  state = IDLE;
}

void light_start(void) {
  let_go();
  readings[LEFT] = readings[RIGHT] = 0;
  age = AGE_NEVER;
}

uint8_t light_pins(void) {
  if (state == IDLE || has_fallen[LEFT]) {
    return 0;
  }
  return LEFT_BIT;
}

void light_on_pin_change(uint8_t bits, uint32_t time) {
  if (state == DECAYING && (bits & LEFT_BIT) == 0) {
    edge[LEFT] = time;
    has_fallen[LEFT] = true;
  }
}

void light_on_left_fall(uint16_t time) {
  edge[LEFT] = clock_cycles_at(time);
  has_fallen[LEFT] = true;
  hal_capture_stop();
}

void light_mask(uint8_t pins) {
  if ((pins & LEFT_BIT) != 0) {
    let_go();
  }
}

#ifdef PIN_LIGHT_RIGHT
void port_d_on_change(uint16_t time) {
  edge[RIGHT] = clock_cycles_at(time);
  has_fallen[RIGHT] = true;
  hal_watch_port_d(0);
}
#endif

static void charge(void) {
#ifdef PIN_LIGHT_LEFT
  HAL_PIN_OUTPUT_HIGH(LIGHT_LEFT);
#endif
#ifdef PIN_LIGHT_RIGHT
  HAL_PIN_OUTPUT_HIGH(LIGHT_RIGHT);
#endif
  has_fallen[LEFT] = has_fallen[RIGHT] = false;
  state = CHARGING;
}

/* Inputs without pull-up: nothing flows but through the phototransistor. */
static void release(void) {
#ifdef LIGHT_LEFT_IS_CAPTURED
  HAL_ATOMIC { hal_capture_start_falling(); }
#endif
#ifdef PIN_LIGHT_LEFT
  HAL_ATOMIC {
    HAL_PIN_INPUT(LIGHT_LEFT);
    released[LEFT] = clock_now();
  }
#endif
#ifdef PIN_LIGHT_RIGHT
  hal_watch_port_d(HAL_PIN_BIT(LIGHT_RIGHT));
  HAL_ATOMIC {
    HAL_PIN_INPUT(LIGHT_RIGHT);
    released[RIGHT] = clock_now();
  }
#endif
  state = DECAYING;
}

#ifdef PIN_LIGHT_RIGHT
/* Decay time in us. Without an edge the line is still high, or it is low and the edge was not seen. */
static uint16_t decay_time(uint8_t side, uint8_t level) {
  if (!has_fallen[side]) {
    return level != 0 ? LIGHT_LONGEST : 0u;
  }
  const uint32_t us = (edge[side] - released[side]) / HAL_CYCLES_PER_US;
  return us == 0 ? 1u : us > LIGHT_LONGEST ? LIGHT_LONGEST : (uint16_t)us;
}
#endif

/* Whether the left edge still waits in the ring of changes: the pin is low, and no fall was seen. */
static bool must_wait(void) {
#ifdef PIN_LIGHT_LEFT
  return LEFT_BIT != 0 && !has_fallen[LEFT] && HAL_PIN_READ(LIGHT_LEFT) == 0;
#else
  return false;
#endif
}

/* A line that is still high may fall until the longest decay is over. */
static bool is_too_early(void) { return clock_now() - released[RIGHT] < LIGHT_LONGEST * (uint32_t)HAL_CYCLES_PER_US; }

static void collect(void) {
#ifdef PIN_LIGHT_LEFT
  readings[LEFT] = decay_time(LEFT, HAL_PIN_READ(LIGHT_LEFT));
#endif
#ifdef PIN_LIGHT_RIGHT
  readings[RIGHT] = decay_time(RIGHT, HAL_PIN_READ(LIGHT_RIGHT));
#endif
  age = 0;
  let_go();
}

/* In every slot. */
void light_task(void) {
  const uint8_t slot = clock_frame_slot();
  if (clock_tick_begins()) {
    clock_grow_older(&age);
  }
  if (!parameters_device_in_use(DEVICES_LIGHT)) {
    if (state != IDLE) {
      let_go();
    }
    readings[LEFT] = readings[RIGHT] = 0;
    age = AGE_NEVER;
  } else if (slot == CHARGE) {
    if (state == DECAYING && !is_too_early()) { /* it had to wait; not longer: the line may never have been high */
      collect();
    }
    charge();
  } else if (slot == RELEASE && state == CHARGING) {
    release();
  } else if (slot == COLLECT && state == DECAYING && !must_wait() && !is_too_early()) {
    collect();
  }
}

bool light_report_devices_telemetry(msg_devices_telemetry *message) {
  message->light_left = readings[LEFT];
  message->light_right = readings[RIGHT];
  message->light_age = age;
  return parameters_device_on(DEVICES_LIGHT);
}
