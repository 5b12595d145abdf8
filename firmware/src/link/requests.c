/* requests.c: see requests.h. */
#include "link/requests.h"

#include <stddef.h>
#include <string.h>

#include "generated/messages.h"
#include "link/counters.h"
#include "link/send.h"
#include "parameters.h"
#include "safety.h"
#include "storage.h"
#include "tasks.h"

/* Beside the statuses that are sent. */
enum {
  NO_REQUEST = 0xFE, /* there was none yet */
  SAVING = 0xFF,     /* a save that still goes on */
};

static msg_answer answer; /* to the last request that was carried out */

void requests_start(void) {
  answer.number = 0;
  answer.status = NO_REQUEST;
}

static void send_answer(void) {
  if (answer.status != SAVING) {
    send_message(MSG_ANSWER_ID, &answer, sizeof answer);
  }
}

/* What changes the parameters while they are being written would make a save of neither the old nor the new. */
static inline bool must_wait(uint8_t id) {
  if (id != MSG_SET_PARAMETER_ID && id != MSG_SAVE_PARAMETERS_ID && id != MSG_RESET_PARAMETERS_ID) {
    return false;
  }
  return storage_busy();
}

/* Returns the answer's status and its value where it has one, which is 0 before. */
static inline uint8_t carry_out(uint8_t id, const uint8_t *payload, int32_t *value) {
  if (must_wait(id)) {
    return ANSWER_STATUS_BUSY;
  }
  uint8_t status = ANSWER_STATUS_OK;
  switch (id) {
    case MSG_GET_PARAMETER_ID: {
      const uint8_t parameter = payload[offsetof(msg_get_parameter, parameter)];
      *value = parameters_get(parameter);
      if (parameter >= PARAMETER_COUNT) {
        status = ANSWER_STATUS_UNKNOWN_PARAMETER;
      }
      break;
    }
    case MSG_SET_PARAMETER_ID: {
      msg_set_parameter message;
      memcpy(&message, payload, sizeof message);
      status = parameters_set(message.parameter, message.value);
      *value = parameters_get(message.parameter);
      break;
    }
    case MSG_SAVE_PARAMETERS_ID:
      status = storage_save();
      if (status == ANSWER_STATUS_OK) {
        status = SAVING;
      }
      break;
    case MSG_RESET_PARAMETERS_ID:
      parameters_reset();
      break;
    default: /* MSG_ARM_ID */
      status = safety_arm(payload[offsetof(msg_arm, latches)]);
      break;
  }
  return status;
}

bool requests_take(uint8_t id, const uint8_t *payload) {
  uint16_t number = 0; /* the first field of every request */
  memcpy(&number, payload, sizeof number);
  if (number == answer.number && answer.status != NO_REQUEST) {
    if (answer.status != SAVING) {
      counters.duplicate++;
    }
  } else if (number == (uint16_t)(answer.number + 1u) && answer.status != SAVING) {
    int32_t value = 0;
    const uint8_t status = carry_out(id, payload, &value);
    answer = (msg_answer){.number = number, .status = status, .value = value};
  } else {
    return false;
  }
  send_answer();
  return true;
}

/* In every tick: answers requests that took longer than a tick. */
void requests_task(void) {
  if (answer.status == SAVING && !storage_busy() && send_has_room(MSG_ANSWER_LENGTH)) {
    answer.status = storage_result();
    send_answer();
  }
}
