/* light.c: see light.h. */
#include "light.h"

#include <stdbool.h>

#include "encoder.h"
#include "generated/messages.h"
#include "hal/hal.h"
#include "link/parameters.h"
#include "pins.h"
#include "schedule.h"

#ifdef PIN_LIGHT_LEFT
_Static_assert(PIN_LIGHT_LEFT >= 14, "the left light sensor's edge is stamped with the encoders', on port C");
#endif
_Static_assert(PIN_LIGHT_RIGHT < 8, "the right light sensor's edge is stamped by port D");

#define SLOTS_PER_FRAME 8u
enum { CHARGE = 7, RELEASE = 0, COLLECT = 6 }; /* slots of a frame */
_Static_assert((COLLECT - RELEASE) * (uint32_t)HAL_SLOT_CYCLES >= (LIGHT_LONGEST + 1000u) * (uint32_t)HAL_CYCLES_PER_US,
               "time to decay, however late in its slot the release");

#define AGE_NEVER 255u

enum { IDLE, CHARGING, DECAYING };
static uint8_t state;
static uint32_t released_at[SIDES]; /* schedule_now() */
static uint16_t readings[SIDES];
static uint8_t age;

/* Inputs without pull-up: nothing flows but through the phototransistor. */
static void let_go(void) {
  hal_stamp_disarm();
#ifdef PIN_LIGHT_LEFT
  encoder_forget_other();
  HAL_PIN_INPUT(LIGHT_LEFT);
#endif
  HAL_PIN_INPUT(LIGHT_RIGHT);
  state = IDLE;
}

void light_start(void) {
  let_go();
  HAL_ZERO(readings[LEFT]);
  HAL_ZERO(readings[RIGHT]);
  age = AGE_NEVER;
}

static void charge(void) {
#ifdef PIN_LIGHT_LEFT
  HAL_PIN_HIGH(LIGHT_LEFT);
  HAL_PIN_OUTPUT(LIGHT_LEFT);
#endif
  HAL_PIN_HIGH(LIGHT_RIGHT);
  HAL_PIN_OUTPUT(LIGHT_RIGHT);
  state = CHARGING;
}

static void release(void) {
#ifdef PIN_LIGHT_LEFT
  encoder_await_other();
  HAL_ATOMIC {
    HAL_PIN_INPUT(LIGHT_LEFT);
    released_at[LEFT] = schedule_now();
  }
#endif
  hal_stamp_arm(HAL_PIN_BIT(LIGHT_RIGHT));
  HAL_ATOMIC {
    HAL_PIN_INPUT(LIGHT_RIGHT);
    released_at[RIGHT] = schedule_now();
  }
  state = DECAYING;
}

/* Time from the release to the edge in us. */
static uint16_t decay_time(uint8_t side, uint32_t edge) {
  const uint32_t us = (edge - released_at[side]) / HAL_CYCLES_PER_US; /* a shift */
  return us == 0 ? 1u : us > LIGHT_LONGEST ? LIGHT_LONGEST : (uint16_t)us;
}

/* Without an edge: still high, or low and the edge was not seen. */
static uint16_t without_edge(uint8_t level) { return level != 0 ? LIGHT_LONGEST : 0u; }

/* Whether the left edge is among the encoders' changes that are still to be worked off: the pin is low. */
static bool must_wait(void) {
#ifdef PIN_LIGHT_LEFT
  return encoder_awaits_other() && HAL_PIN_READ(LIGHT_LEFT) == 0;
#else
  return false;
#endif
}

static void collect(void) {
#ifdef PIN_LIGHT_LEFT
  readings[LEFT] =
      encoder_saw_other() ? decay_time(LEFT, encoder_other_edge()) : without_edge(HAL_PIN_READ(LIGHT_LEFT));
#endif
  readings[RIGHT] = hal_stamp_awaited() ? without_edge(HAL_PIN_READ(LIGHT_RIGHT))
                                        : decay_time(RIGHT, schedule_cycles_at(hal_stamp_slot, hal_stamp_time));
  age = 0;
  let_go();
}

void light_task(void) {
  const uint8_t slot = schedule_next_slot % SLOTS_PER_FRAME;
  if (slot % SCHEDULE_SLOTS_PER_TICK == 0 && age < AGE_NEVER) {
    age++;
  }
  if (!parameters_device_on(DEVICES_LIGHT)) {
    if (state != IDLE) {
      let_go();
    }
    readings[LEFT] = readings[RIGHT] = 0;
    age = AGE_NEVER;
  } else if (slot == CHARGE) {
    if (state == DECAYING) { /* had to wait; no longer, the line may be one that never was high */
      collect();
    }
    charge();
  } else if (slot == RELEASE && state == CHARGING) {
    release();
  } else if (slot == COLLECT && state == DECAYING && !must_wait()) {
    collect();
  }
}

uint16_t light_read(uint8_t side) { return readings[side]; }

uint8_t light_age(void) { return age; }
