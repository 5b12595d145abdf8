/* dispatch.c: see dispatch.h. */
#include "link/dispatch.h"

#include <string.h>

#include "generated/messages.h"
#include "link/identity.h"
#include "link/parameters.h"
#include "link/send.h"
#include "motion.h"
#include "safety.h"

static uint8_t setpoint_sequence;

void dispatch_start(void) { setpoint_sequence = 0; }

uint8_t dispatch_setpoint_sequence(void) { return setpoint_sequence; }

static bool within(int16_t value, int16_t minimum, int16_t maximum) { return value >= minimum && value <= maximum; }

static bool setpoint_signal(uint8_t sequence, const uint8_t *payload) {
  msg_setpoint_signal message;
  memcpy(&message, payload, sizeof message);
  if (!within(message.left, MSG_SETPOINT_SIGNAL_LEFT_MIN, MSG_SETPOINT_SIGNAL_LEFT_MAX) ||
      !within(message.right, MSG_SETPOINT_SIGNAL_RIGHT_MIN, MSG_SETPOINT_SIGNAL_RIGHT_MAX) ||
      !safety_accept(message.time_to_live)) {
    return false;
  }
  motion_signals(message.left, message.right);
  setpoint_sequence = sequence;
  return true;
}

static bool setpoint_speed(uint8_t sequence, const uint8_t *payload) {
  msg_setpoint_speed message;
  memcpy(&message, payload, sizeof message);
  if (!within(message.left, MSG_SETPOINT_SPEED_LEFT_MIN, MSG_SETPOINT_SPEED_LEFT_MAX) ||
      !within(message.right, MSG_SETPOINT_SPEED_RIGHT_MIN, MSG_SETPOINT_SPEED_RIGHT_MAX) ||
      !safety_accept(message.time_to_live)) {
    return false;
  }
  motion_speeds(message.left, message.right);
  setpoint_sequence = sequence;
  return true;
}

static void answer_parameter(uint8_t parameter, uint8_t status) {
  const msg_parameter answer = {.parameter = parameter, .value = parameters_get(parameter), .status = status};
  send_message(MSG_PARAMETER_ID, &answer, sizeof answer);
}

static void get_parameter(const uint8_t *payload) {
  const uint8_t parameter = payload[0];
  answer_parameter(parameter, parameter < PARAMETER_COUNT ? PARAMETER_STATUS_OK : PARAMETER_STATUS_UNKNOWN_PARAMETER);
}

static void set_parameter(const uint8_t *payload) {
  msg_set_parameter message;
  memcpy(&message, payload, sizeof message);
  answer_parameter(message.parameter, parameters_set(message.parameter, message.value));
}

bool dispatch_answers(uint8_t id) {
  return id == MSG_HELLO_REQUEST_ID || id == MSG_IDENTIFY_ID || id == MSG_GET_PARAMETER_ID ||
         id == MSG_SET_PARAMETER_ID;
}

bool dispatch(uint8_t id, uint8_t sequence, const uint8_t *payload) {
  switch (id) {
    case MSG_HELLO_REQUEST_ID:
      identity_send_hello();
      return true;
    case MSG_IDENTIFY_ID:
      identity_send();
      return true;
    case MSG_SETPOINT_SIGNAL_ID:
      return setpoint_signal(sequence, payload);
    case MSG_SETPOINT_SPEED_ID:
      return setpoint_speed(sequence, payload);
    case MSG_STOP_ID:
      safety_stop();
      return true;
    case MSG_GET_PARAMETER_ID:
      get_parameter(payload);
      return true;
    case MSG_SET_PARAMETER_ID:
      set_parameter(payload);
      return true;
    default:
      return false;
  }
}
