/* safety.c: see safety.h. */
#include "safety.h"

#include "buzzer.h"
#include "generated/messages.h"
#include "hal/hal.h"
#include "link/events.h"
#include "link/parameters.h"
#include "motion.h"
#include "schedule.h"
#include "supply.h"
#include "turret.h"

#define TIME_TO_LIVE_MAX MSG_SETPOINT_SIGNAL_TIME_TO_LIVE_MAX              /* ms; of every kind of set-point */
#define AGE_MAX ((uint16_t)(TIME_TO_LIVE_MAX * 1000ul / SCHEDULE_TICK_US)) /* ticks; all older ones are late */

_Static_assert(MSG_SETPOINT_SPEED_TIME_TO_LIVE_MAX == TIME_TO_LIVE_MAX, "one limit for all");
_Static_assert(MSG_SETPOINT_COAST_TIME_TO_LIVE_MAX == TIME_TO_LIVE_MAX, "one limit for all");

typedef struct {
  uint8_t latch;   /* LATCH_... */
  uint8_t latches; /* how often */
  uint8_t state;   /* STATUS_MOTORS_ENABLED: a set-point is in force; STATUS_DEAD_MAN: it has outlived itself; or 0 */
  bool ticks_are_over; /* set-points of ticks up to last_over are late, however long they shall live: */
  uint16_t last_over;  /* the tick in which the motors were armed, or that of a set-point that has outlived itself */

  /* The last set-point that was accepted: */
  uint32_t deadline;  /* schedule_time() at which it ends */
  uint16_t last_tick; /* the tick that it answers */
  uint8_t last_sequence;
} safety_state;

static safety_state own;

/* Whatever stops the motors also releases the turret and silences the buzzer. */
static void stop_all(void) {
  motion_off();
  turret_release();
  buzzer_silence();
}

void safety_start(void) {
  safety_state *const self = &own;
  self->latch = LATCH_START;
  self->latches = 1;
  HAL_ZERO(self->state);
  HAL_ZERO(self->ticks_are_over);
  HAL_ZERO(self->last_sequence);
  motion_off();
}

static void end_ticks(safety_state *self, uint16_t up_to) {
  self->last_over = up_to;
  self->ticks_are_over = true;
}

/* Whether the set-point in force is newer than another one, or is that one. */
static bool has_newer(safety_state *self, uint16_t answers_tick, uint8_t sequence) {
  const int16_t ticks = (int16_t)(answers_tick - self->last_tick);
  return (self->state & STATUS_MOTORS_ENABLED) != 0 &&
         (ticks < 0 || (ticks == 0 && (int8_t)(sequence - self->last_sequence) <= 0));
}

safety_verdict safety_accept(uint16_t time_to_live, uint16_t answers_tick, uint8_t sequence) {
  safety_state *const self = &own;
  if (self->latch != LATCH_NONE || time_to_live > TIME_TO_LIVE_MAX || !parameters_device_on(DEVICES_SERVOS)) {
    return SAFETY_REFUSED;
  }
  const uint16_t ticks = (uint16_t)((uint16_t)schedule_tick() - answers_tick);
  if (ticks > AGE_MAX) { /* a tick to come is one of long ago */
    return SAFETY_LATE;
  }
  const uint32_t start = schedule_tick_time() - ticks * (uint32_t)SCHEDULE_TICK_US;
  /* Vast before a tick that has not begun although its tasks are awaited. */
  const uint32_t age = schedule_time() - start;
  const uint32_t life = (time_to_live != 0 ? time_to_live : parameters_u16(PARAMETER_TIME_TO_LIVE)) * 1000ul;
  if (age >= life || has_newer(self, answers_tick, sequence) ||
      (self->ticks_are_over && (int16_t)(answers_tick - self->last_over) <= 0)) {
    return SAFETY_LATE;
  }
  self->deadline = start + life;
  self->state = STATUS_MOTORS_ENABLED;
  self->last_tick = answers_tick;
  self->last_sequence = sequence;
  return SAFETY_ACCEPTED;
}

uint8_t safety_setpoint_sequence(void) { return own.last_sequence; }

void safety_latch(uint8_t reason) {
  safety_state *const self = &own;
  stop_all();
  self->state = 0;
  if (self->latch == LATCH_NONE) {
    self->latch = reason;
    events_raise(EVENT_KIND_LATCH, reason);
  } else if (reason != LATCH_STOP_COMMAND) {
    return;
  }
  self->latches++;
}

uint8_t safety_latches(void) { return own.latches; }

uint8_t safety_arm(uint8_t known_latches) {
  safety_state *const self = &own;
  if (known_latches != self->latches) {
    return ANSWER_STATUS_LATCHED_AGAIN;
  }
  if (supply_low() || supply_voltage() == 0) {
    return ANSWER_STATUS_SUPPLY_LOW;
  }
  if (self->latch != LATCH_NONE) {
    self->latch = LATCH_NONE;
    end_ticks(self, schedule_begun_tick());
    events_raise(EVENT_KIND_LATCH, LATCH_NONE);
  }
  return ANSWER_STATUS_OK;
}

uint8_t safety_latched(void) { return own.latch; }

void safety_task(void) {
  safety_state *const self = HAL_NEAR(&own);
  if ((uint16_t)((uint16_t)schedule_tick() - self->last_over) > AGE_MAX + 1u) { /* before the difference rolls over */
    self->ticks_are_over = false;
  }
  if (supply_low()) { /* ends a set-point too: nothing else is to be done then */
    safety_latch(LATCH_SUPPLY_LOW);
    return;
  }
  if ((self->state & STATUS_MOTORS_ENABLED) == 0) {
    return;
  }
  if (!parameters_device_on(DEVICES_SERVOS)) {
    self->state = 0;
    motion_off();
  } else if ((int32_t)(schedule_time() - self->deadline) >= 0) {
    self->state = STATUS_DEAD_MAN;
    stop_all();
    events_raise(EVENT_KIND_DEAD_MAN, self->last_tick);
  } else {
    return;
  }
  end_ticks(self, self->last_tick);
}

uint16_t safety_status(void) { return (uint16_t)(own.state | (own.latch != LATCH_NONE ? STATUS_LATCHED : 0u)); }
