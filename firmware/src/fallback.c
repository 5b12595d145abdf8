/* fallback.c: see fallback.h. A state machine: it stays in a state for some ticks, unless something is touched or seen.
 *
 *   WAIT     stands still, before it begins, and while its way has been blocked for too long
 *   WANDER   drives ahead, straight or in a slight curve, by chance
 *   BACK     goes back from what a whisker has touched, and then turns away from it
 *   TURN_... turns in place, away from what was touched or is seen, until nothing is seen */
#include "fallback.h"

#include <stdbool.h>
#include <stdint.h>

#include "clock.h"
#include "events.h"
#include "generated/values.h"
#include "infrared.h"
#include "motion.h"
#include "parameters.h"
#include "safety.h"
#include "tasks.h"
#include "whisker.h"

#define TICK_MS (CLOCK_TICK_US / 1000u)

/* Motor signals in eighths. */
#define SLOW 3
#define SLOWER 2

/* In ticks. */
#define WAIT_TIME 50u
#define WANDER_TIME_MIN 100u
#define BACK_TIME 50u
#define TURN_TIME 40u
#define BLOCKED_TIME 500u /* two whole turns in place: a sensor is broken, or there is no way out */
#define INFRARED_AGE_MAX 20u

/* Whiskers and IR pairs have the same bits for the sides. */
#define SIDE_LEFT WHISKERS_LEFT
#define SIDE_RIGHT WHISKERS_RIGHT
_Static_assert(SIDE_LEFT == INFRARED_LEFT && SIDE_RIGHT == INFRARED_RIGHT, "one meaning of the bits");

typedef enum { WAIT, WANDER, BACK, TURN_LEFT, TURN_RIGHT } fallback_state;

static uint16_t silence; /* ms since the host spoke, or since the start */
static bool drives;

static fallback_state state;
static uint8_t ticks_left;   /* of the state */
static int8_t left, right;   /* motor signals of the state */
static uint8_t touched_side; /* what BACK goes away from */
static uint8_t was_touched;  /* a tick ago */
static uint16_t blocked;     /* ticks in which something was touched or seen, without a break */
static uint16_t chance;

void fallback_start(void) {
  silence = 0;
  drives = false;
  chance = 1;
}

/* ---- what it does ---- */

static void begin(fallback_state next, uint8_t ticks, int8_t left_signal, int8_t right_signal) {
  state = next;
  ticks_left = ticks;
  left = left_signal;
  right = right_signal;
}

static uint8_t draw(void) {
  chance = (uint16_t)(chance * 25173u + 13849u);
  return (uint8_t)(chance >> 8);
}

static void wander(void) {
  const uint8_t drawn = draw();
  begin(WANDER, (uint8_t)(WANDER_TIME_MIN + drawn / 2u), drawn % 4u == 1u ? SLOWER : SLOW,
        drawn % 4u == 2u ? SLOWER : SLOW);
}

static void turn_away_from(uint8_t sides) {
  const bool to_left = sides == SIDE_RIGHT || (sides != SIDE_LEFT && draw() % 2u != 0);
  if (to_left) {
    begin(TURN_LEFT, TURN_TIME, -SLOW, SLOW);
  } else {
    begin(TURN_RIGHT, TURN_TIME, SLOW, -SLOW);
  }
}

static void count_blocked(bool is_blocked) {
  if (!is_blocked) {
    blocked = 0;
  } else if (blocked < BLOCKED_TIME) {
    blocked++;
  }
}

static void choose_state(void) {
  const uint8_t touched = whisker_read();
  const uint8_t seen = infrared_read();
  const bool newly_touched = (touched & (uint8_t)~was_touched) != 0;
  was_touched = touched;
  count_blocked(touched != 0 || seen != 0);
  if (blocked == BLOCKED_TIME) {
    begin(WAIT, WAIT_TIME, 0, 0);
  } else if (state != WAIT && (newly_touched || (touched != 0 && state == WANDER))) {
    touched_side = touched;
    begin(BACK, BACK_TIME, -SLOW, -SLOW);
  } else if (seen != 0 && state == WANDER) {
    turn_away_from(seen);
  } else if (ticks_left != 0) {
    ticks_left--;
  } else if (state == BACK) {
    turn_away_from(touched_side);
  } else if (seen != 0 && state != WAIT) {
    ticks_left = TURN_TIME; /* the same way on */
  } else {
    wander();
  }
}

static void move(void) {
  if (state == WAIT) {
    motion_off();
  } else {
    motion_eighths(left, right);
  }
}

/* ---- whether it drives ---- */

static bool host_is_silent(void) {
  const uint16_t after = parameters_u16(PARAMETER_FALLBACK_AFTER);
  return after != 0 && silence >= after;
}

static bool senses_obstacles(void) {
  if (parameters_device_on(DEVICES_INFRARED)) {
    return infrared_age() <= INFRARED_AGE_MAX && parameters_u16(PARAMETER_INFRARED_PERIOD) <= INFRARED_AGE_MAX;
  }
  return parameters_device_on(DEVICES_WHISKER);
}

static void take_over(void) {
  drives = true;
  blocked = 0;
  was_touched = 0;
  begin(WAIT, WAIT_TIME, 0, 0);
  events_raise(EVENT_KIND_FALLBACK, 1);
}

static void hand_back(void) {
  drives = false;
  safety_end_fallback();
  events_raise(EVENT_KIND_FALLBACK, 0);
}

void fallback_host_spoke(void) {
  silence = 0;
  if (drives) {
    hand_back();
  }
}

/* In every tick. */
void fallback_task(void) {
  silence = (uint16_t)(silence <= UINT16_MAX - TICK_MS ? silence + TICK_MS : UINT16_MAX);
  const bool may_drive = host_is_silent() && senses_obstacles() && safety_accept_fallback();
  if (may_drive && drives) {
    choose_state();
    move();
  } else if (may_drive) {
    take_over();
  } else if (drives) {
    hand_back();
  }
}
