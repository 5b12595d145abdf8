/* requests.c: see requests.h. */
#include "link/requests.h"

#include <stddef.h>
#include <string.h>

#include "generated/messages.h"
#include "link/counters.h"
#include "link/parameters.h"
#include "link/send.h"
#include "safety.h"
#include "storage.h"

static msg_answer answer; /* to the last request that was carried out; its number is 0 at first, */
static bool any;          /* when there was none */
static bool saving;       /* it is a save that still goes on */

void requests_start(void) {
  answer = (msg_answer){0};
  any = false;
  saving = false;
}

static void send_answer(void) { send_message(MSG_ANSWER_ID, &answer, sizeof answer); }

static void get_parameter(const uint8_t *payload) {
  msg_get_parameter message;
  memcpy(&message, payload, sizeof message);
  answer.status = message.parameter < PARAMETER_COUNT ? ANSWER_STATUS_OK : ANSWER_STATUS_UNKNOWN_PARAMETER;
  answer.value = parameters_get(message.parameter);
}

static void set_parameter(const uint8_t *payload) {
  msg_set_parameter message;
  memcpy(&message, payload, sizeof message);
  answer.status = parameters_set(message.parameter, message.value);
  answer.value = parameters_get(message.parameter);
}

/* What changes the parameters while they are being written would make a save of neither the old nor the new. */
static bool must_wait(uint8_t id) {
  return storage_busy() &&
         (id == MSG_SET_PARAMETER_ID || id == MSG_SAVE_PARAMETERS_ID || id == MSG_RESET_PARAMETERS_ID);
}

static void carry_out(uint8_t id, const uint8_t *payload) {
  answer.status = ANSWER_STATUS_OK;
  answer.value = 0;
  if (must_wait(id)) {
    answer.status = ANSWER_STATUS_BUSY;
    return;
  }
  switch (id) {
    case MSG_GET_PARAMETER_ID:
      get_parameter(payload);
      break;
    case MSG_SET_PARAMETER_ID:
      set_parameter(payload);
      break;
    case MSG_SAVE_PARAMETERS_ID:
      answer.status = storage_save();
      saving = answer.status == ANSWER_STATUS_OK;
      break;
    case MSG_RESET_PARAMETERS_ID:
      parameters_reset();
      break;
    default: /* MSG_ARM_ID */
      answer.status = safety_arm(payload[offsetof(msg_arm, latches)]);
      break;
  }
}

bool requests_take(uint8_t id, const uint8_t *payload) {
  uint16_t number = 0; /* the first field of every request */
  memcpy(&number, payload, sizeof number);
  if (any && number == answer.number) {
    if (!saving) {
      counters.duplicate++;
      send_answer();
    }
    return true;
  }
  if (number != (uint16_t)(answer.number + 1u) || saving) {
    return false;
  }
  any = true;
  answer.number = number;
  carry_out(id, payload);
  if (!saving) {
    send_answer();
  }
  return true;
}

void requests_task(void) {
  if (saving && !storage_busy() && send_has_room(MSG_ANSWER_LENGTH)) {
    saving = false;
    answer.status = storage_result();
    send_answer();
  }
}
