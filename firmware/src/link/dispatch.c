/* dispatch.c: see dispatch.h. */
#include "link/dispatch.h"

#include <string.h>

#include "buzzer.h"
#include "clock.h"
#include "generated/messages.h"
#include "link/counters.h"
#include "link/event_delivery.h"
#include "link/identity.h"
#include "link/requests.h"
#include "link/send.h"
#include "link/session.h"
#include "link/session_seed.h"
#include "motion.h"
#include "parameters.h"
#include "safety.h"
#include "turret.h"

/* Whether a set-point may be put in force; counts the late ones. A late one is not refused: it was valid
 * when it was sent. */
static bool may_move(uint16_t time_to_live, uint16_t answers_tick, uint8_t sequence, bool *refused) {
  const safety_verdict verdict = safety_accept(time_to_live, answers_tick, sequence);
  if (verdict == SAFETY_LATE) {
    counters.late++;
  }
  *refused = verdict == SAFETY_REFUSED;
  return verdict == SAFETY_ACCEPTED;
}

_Static_assert(MSG_SETPOINT_SIGNAL_TIME_TO_LIVE_MAX == SAFETY_TIME_TO_LIVE_MAX &&
                   MSG_SETPOINT_SPEED_TIME_TO_LIVE_MAX == SAFETY_TIME_TO_LIVE_MAX &&
                   MSG_SETPOINT_COAST_TIME_TO_LIVE_MAX == SAFETY_TIME_TO_LIVE_MAX,
               "one limit for all");

static bool beyond(int16_t value, int16_t most) { return value > most || value < -most; }

/* Signals and speeds have one layout, and ranges with zero in the middle. */
_Static_assert(sizeof(msg_setpoint_signal) == sizeof(msg_setpoint_speed) && MSG_SETPOINT_SIGNAL_LENGTH == 8,
               "one layout");
#define SYMMETRIC(field) (field##_MIN == -field##_MAX)
_Static_assert(SYMMETRIC(MSG_SETPOINT_SIGNAL_LEFT) && SYMMETRIC(MSG_SETPOINT_SPEED_LEFT), "left");
_Static_assert(MSG_SETPOINT_SIGNAL_RIGHT_MAX == MSG_SETPOINT_SIGNAL_LEFT_MAX &&
                   MSG_SETPOINT_SIGNAL_RIGHT_MIN == MSG_SETPOINT_SIGNAL_LEFT_MIN,
               "right as left");
_Static_assert(MSG_SETPOINT_SPEED_RIGHT_MAX == MSG_SETPOINT_SPEED_LEFT_MAX &&
                   MSG_SETPOINT_SPEED_RIGHT_MIN == MSG_SETPOINT_SPEED_LEFT_MIN,
               "right as left");

static bool setpoint(uint8_t id, uint8_t sequence, const uint8_t *payload) {
  msg_setpoint_signal message;
  memcpy(&message, payload, sizeof message);
  const bool is_speed = id == MSG_SETPOINT_SPEED_ID;
  const int16_t most = is_speed ? MSG_SETPOINT_SPEED_LEFT_MAX : MSG_SETPOINT_SIGNAL_LEFT_MAX;
  bool refused = beyond(message.left, most) || beyond(message.right, most);
  if (!refused && may_move(message.time_to_live, message.answers_tick, sequence, &refused)) {
    if (is_speed) {
      motion_speeds(message.left, message.right);
    } else {
      motion_signals(message.left, message.right);
    }
  }
  return !refused;
}

static bool setpoint_coast(uint8_t sequence, const uint8_t *payload) {
  msg_setpoint_coast message;
  memcpy(&message, payload, sizeof message);
  bool refused = false;
  if (may_move(message.time_to_live, message.answers_tick, sequence, &refused)) {
    motion_off();
  }
  return !refused;
}

/* The turret is a motor: it does not move while they are latched off. It may be released at any time. */
static bool turret(const uint8_t *payload) {
  msg_turret message;
  memcpy(&message, payload, sizeof message);
  if (message.hold == 0) {
    turret_release();
    return true;
  }
  if (message.hold > MSG_TURRET_HOLD_MAX || beyond(message.angle, MSG_TURRET_ANGLE_MAX) ||
      safety_latched() != LATCH_NONE || !parameters_device_on(DEVICES_TURRET)) {
    return false;
  }
  turret_hold(message.angle);
  return true;
}
_Static_assert(SYMMETRIC(MSG_TURRET_ANGLE), "turret");

static bool buzzer(const uint8_t *payload) {
  msg_buzzer message;
  memcpy(&message, payload, sizeof message);
  return buzzer_tone(message.frequency, message.duration, message.token);
}

static bool open(const uint8_t *payload) {
  msg_open message;
  memcpy(&message, payload, sizeof message);
  return session_open(&message);
}

static bool close(const uint8_t *payload) {
  msg_close message;
  memcpy(&message, payload, sizeof message);
  return session_close(message.session);
}

static bool describe(const uint8_t *payload) {
  msg_describe message;
  memcpy(&message, payload, sizeof message);
  if (message.board_nonce != session_board_nonce()) {
    return false;
  }
  identity_describe(message.index);
  return true;
}

static void acknowledge(const uint8_t *payload) {
  msg_acknowledge message;
  memcpy(&message, payload, sizeof message);
  event_delivery_acknowledge(message.number);
}

/* Not in line: so the length of what each of them sends stays a constant, which the bound of a poll needs. */
#define SENDS static __attribute__((noinline)) void

/* A stop needs no room: its confirmation may be lost, and the host asks again. It waits only behind a request that waits for
 * room (link.h). */
SENDS stop(const uint8_t *payload) {
  safety_latch(LATCH_STOP_COMMAND);
  const msg_stopped stopped = {.token = payload[0]};
  send_message(MSG_STOPPED_ID, &stopped, sizeof stopped);
}

SENDS clock_probe(const uint8_t *payload) {
  msg_clock_answer answer = {.time = clock_time()};
  memcpy(&answer.token, payload, sizeof answer.token);
  send_message(MSG_CLOCK_ANSWER_ID, &answer, sizeof answer);
}

uint8_t dispatch_room(uint8_t id) {
  switch (id) {
    case MSG_DESCRIBE_ID:
      return SEND_RESERVE + MSG_DESCRIPTION_LENGTH;
    case MSG_CLOCK_PROBE_ID:
      return SEND_RESERVE + MSG_CLOCK_ANSWER_LENGTH;
    case MSG_GET_PARAMETER_ID:
    case MSG_SET_PARAMETER_ID:
    case MSG_SAVE_PARAMETERS_ID:
    case MSG_RESET_PARAMETERS_ID:
    case MSG_ARM_ID:
      return SEND_RESERVE + MSG_ANSWER_LENGTH;
    default:
      return 0;
  }
}

bool dispatch(uint8_t id, uint8_t sequence, const uint8_t *payload) {
  switch (id) {
    case MSG_OPEN_ID:
      return open(payload);
    case MSG_IDENTIFY_ID:
      session_identify();
      return true;
    case MSG_DESCRIBE_ID:
      return describe(payload);
    case MSG_CLOSE_ID:
      return close(payload);
    case MSG_STOP_ID:
      stop(payload);
      return true;
    case MSG_SETPOINT_SIGNAL_ID:
    case MSG_SETPOINT_SPEED_ID:
      return setpoint(id, sequence, payload);
    case MSG_SETPOINT_COAST_ID:
      return setpoint_coast(sequence, payload);
    case MSG_TURRET_ID:
      return turret(payload);
    case MSG_BUZZER_ID:
      return buzzer(payload);
    case MSG_ACKNOWLEDGE_ID:
      acknowledge(payload);
      return true;
    case MSG_CLOCK_PROBE_ID:
      clock_probe(payload);
      return true;
    default: /* the numbered ones: no other message is accepted */
      return requests_take(id, payload);
  }
}
