/* safety.c: see safety.h. */
#include "safety.h"

#include "buzzer.h"
#include "clock.h"
#include "events.h"
#include "generated/values.h"
#include "hal/hal.h"
#include "motion.h"
#include "parameters.h"
#include "reset.h"
#include "supply.h"
#include "tasks.h"
#include "turret.h"

#define AGE_MAX ((uint16_t)(SAFETY_TIME_TO_LIVE_MAX * 1000ul / CLOCK_TICK_US)) /* ticks; all older ones are late */

typedef struct {
  uint8_t latch;         /* LATCH_... */
  uint8_t latches;       /* how often */
  bool fallback_allowed; /* the board's own brain may drive, latched or not */

  /* STATUS_MOTORS_ENABLED: a set-point is in force; STATUS_DEAD_MAN: it has outlived itself; STATUS_FALLBACK: the
   * board's own brain drives; or 0 */
  uint16_t state;

  bool ticks_are_over; /* set-points of ticks up to last_over are late, however long they shall live: */
  uint16_t last_over;  /* the tick in which the motors were armed, or that of a set-point that has outlived itself */

  /* The last set-point that was accepted: */
  uint32_t deadline;  /* clock_time() at which it ends */
  uint16_t last_tick; /* the tick that it answers */
  uint8_t last_sequence;
} safety_state;

static safety_state own;

/* Each stop of the motors also releases the turret and silences the buzzer. */
static void stop_all(void) {
  own.state = 0;
  motion_off();
  turret_release();
  buzzer_silence();
}

/* Neither a fault nor a start whose cause nobody knows. */
static bool was_started_by_somebody(void) {
  return reset_cause() == RESET_CAUSE_POWER || reset_cause() == RESET_CAUSE_EXTERNAL;
}

void safety_start(void) {
  own = (safety_state){
      .latch = LATCH_START,
      .latches = 1,
      .fallback_allowed = parameters_u16(PARAMETER_FALLBACK_AT_START) != 0 && was_started_by_somebody(),
  };
  motion_off();
}

static void end_ticks(uint16_t up_to) {
  own.last_over = up_to;
  own.ticks_are_over = true;
}

/* Whether the set-point in force is newer than another one, or is that one. */
static bool has_newer(uint16_t answers_tick, uint8_t sequence) {
  const int16_t ticks = (int16_t)(answers_tick - own.last_tick);
  return (own.state & STATUS_MOTORS_ENABLED) != 0 &&
         (ticks < 0 || (ticks == 0 && (int8_t)(sequence - own.last_sequence) <= 0));
}

safety_verdict safety_accept(uint16_t time_to_live, uint16_t answers_tick, uint8_t sequence) {
  if (own.latch != LATCH_NONE || time_to_live > SAFETY_TIME_TO_LIVE_MAX || !parameters_device_on(DEVICES_SERVO)) {
    return SAFETY_REFUSED;
  }
  const uint16_t ticks = (uint16_t)((uint16_t)clock_tick() - answers_tick);
  if (ticks > AGE_MAX) { /* a tick to come is one of long ago */
    return SAFETY_LATE;
  }
  const uint32_t start = clock_tick_time() - ticks * (uint32_t)CLOCK_TICK_US;
  /* Huge, hence late, for a tick that has not begun yet: its start lies ahead. */
  const uint32_t age = clock_time() - start;
  const uint32_t life = (time_to_live != 0 ? time_to_live : parameters_u16(PARAMETER_TIME_TO_LIVE)) * 1000ul;
  if (age >= life || has_newer(answers_tick, sequence) ||
      (own.ticks_are_over && (int16_t)(answers_tick - own.last_over) <= 0)) {
    return SAFETY_LATE;
  }
  own.deadline = start + life;
  own.state = STATUS_MOTORS_ENABLED;
  own.last_tick = answers_tick;
  own.last_sequence = sequence;
  return SAFETY_ACCEPTED;
}

uint8_t safety_setpoint_sequence(void) { return own.last_sequence; }

static void enter_latch(uint8_t reason) {
  own.latch = reason;
  own.latches++;
  events_raise(EVENT_KIND_LATCH, reason);
}

void safety_latch(uint8_t reason) {
  const bool could_move = own.latch == LATCH_NONE || own.state == STATUS_FALLBACK;
  own.fallback_allowed = false;
  stop_all();
  if (could_move) {
    enter_latch(reason);
  } else if (reason == LATCH_STOP_COMMAND) {
    own.latches++;
  }
}

void safety_host_lost(void) {
  if (own.state != STATUS_FALLBACK) {
    stop_all();
  }
  if (own.latch == LATCH_NONE) {
    enter_latch(LATCH_SESSION_ENDED);
  }
}

uint8_t safety_latches(void) { return own.latches; }

uint8_t safety_arm(uint8_t known_latches) {
  if (known_latches != own.latches) {
    return ANSWER_STATUS_LATCHED_AGAIN;
  }
  if (supply_low() || supply_voltage() == 0) {
    return ANSWER_STATUS_SUPPLY_LOW;
  }
  if (own.latch != LATCH_NONE) {
    own.latch = LATCH_NONE;
    own.fallback_allowed = true;
    end_ticks(clock_begun_tick());
    events_raise(EVENT_KIND_LATCH, LATCH_NONE);
  }
  return ANSWER_STATUS_OK;
}

uint8_t safety_latched(void) { return own.latch; }

bool safety_accept_fallback(void) {
  if (!own.fallback_allowed || (own.state & STATUS_MOTORS_ENABLED) != 0 || !parameters_device_on(DEVICES_SERVO) ||
      supply_low() || supply_voltage() == 0) {
    return false;
  }
  own.state = STATUS_FALLBACK;
  return true;
}

void safety_end_fallback(void) {
  if (own.state == STATUS_FALLBACK) {
    stop_all();
  }
}

/* In every slot: ends set-points that have outlived themselves, latches when the supply is low. */
void safety_task(void) {
  if ((uint16_t)((uint16_t)clock_tick() - own.last_over) > AGE_MAX + 1u) { /* before the difference rolls over */
    own.ticks_are_over = false;
  }
  if (supply_low()) {
    if (own.latch == LATCH_NONE || own.fallback_allowed) { /* once: a tone that is asked for later may sound */
      safety_latch(LATCH_SUPPLY_LOW);
    }
    return;
  }
  if ((own.state & STATUS_MOTORS_ENABLED) == 0) {
    return;
  }
  if (!parameters_device_on(DEVICES_SERVO)) {
    own.state = 0;
    motion_off();
  } else if ((int32_t)(clock_time() - own.deadline) >= 0) {
    stop_all();
    own.state = STATUS_DEAD_MAN;
    events_raise(EVENT_KIND_DEAD_MAN, own.last_tick);
  } else {
    return;
  }
  end_ticks(own.last_tick);
}

uint16_t safety_status(void) { return (uint16_t)(own.state | (own.latch != LATCH_NONE ? STATUS_LATCHED : 0u)); }
