/* session.c: see session.h. */
#include "link/session.h"

#include "buzzer.h"
#include "clock.h"
#include "events.h"
#include "fallback.h"
#include "hal/hal.h"
#include "link/event_delivery.h"
#include "link/frame.h"
#include "link/identity.h"
#include "link/receive.h"
#include "link/requests.h"
#include "link/send.h"
#include "link/session_seed.h"
#include "link/telemetry.h"
#include "parameters.h"
#include "safety.h"
#include "task_times.h"
#include "tasks.h"

#define TICK_MS (CLOCK_TICK_US / 1000u)
#define HELLO_PERIOD_ALONE 10u /* ticks */
#define HELLO_PERIOD_OPEN 20u  /* or, if that is longer, */
#define HELLO_TELEMETRIES 4u   /* of the shortest periods of telemetry that the line allows */

static uint16_t silence; /* ms since a frame of the session came, in whole ticks */
static uint8_t hello_in; /* ticks until the next hello; 0: it waits for the task, or for room */
static bool identify;    /* the host has asked for the identity */

/* Says hello or, where that would leave no room for the next telemetry, does so in a later tick. */
static void say_hello(void) {
  uint8_t room = MSG_HELLO_LENGTH + FRAME_OVERHEAD;
  uint8_t period = HELLO_PERIOD_ALONE;
  if (session_is_open()) {
    room = MSG_HELLO_LENGTH + SEND_RESERVE;
    const uint8_t telemetries = (uint8_t)(HELLO_TELEMETRIES * telemetry_line_period()); /* 40 on the slowest line */
    period = telemetries > HELLO_PERIOD_OPEN ? telemetries : HELLO_PERIOD_OPEN;
  }
  hello_in = 0;
  if (hal_serial_room(room)) {
    identity_send_hello();
    hello_in = period;
  }
}

/* Begins anew, with a session or without (FRAME_NO_SESSION). Hello is due. */
static void begin(uint32_t new_seed) {
  session_use_seed(new_seed);
  receive_use_seed(new_seed);
  requests_start();
  events_forget_touches();
  event_delivery_start();
  telemetry_start();
  task_times_start();
  buzzer_start_session();
  silence = 0;
  hello_in = 0;
}

void session_start(void) {
  identify = false;
  begin(FRAME_NO_SESSION);
  say_hello();
}

bool session_open(const msg_open *message) {
  const uint32_t wanted = message->board_nonce ^ message->host_nonce;
  if (wanted == 0 || (wanted & ~FRAME_SEED_MAX) != 0 || wanted == FRAME_SEED) {
    return false;
  }
  const bool is_new = wanted != session_seed();
  if (is_new && (PROTOCOL_MAJOR(message->protocol_version) != PROTOCOL_MAJOR(PROTOCOL_VERSION) ||
                 message->board_nonce != session_board_nonce())) {
    return false;
  }
  fallback_host_spoke();
  if (is_new) {
    safety_latch(LATCH_SESSION_ENDED);
    begin(wanted);
    parameters_host_has_come();
  }
  hello_in = 0;
  return true;
}

bool session_close(uint32_t of) {
  if (of != session_seed()) {
    return false;
  }
  safety_latch(LATCH_SESSION_ENDED);
  begin(FRAME_NO_SESSION);
  return true;
}

void session_identify(void) { identify = true; }

void session_heard(void) {
  silence = 0;
  fallback_host_spoke();
}

/* In every tick: says hello when it is due, ends the session when the host was silent for too long. */
void session_task(void) {
  silence = (uint16_t)(silence + TICK_MS); /* rolls over only without a session */
  if (session_is_open() && silence > parameters_u16(PARAMETER_SESSION_TIME_OUT)) {
    safety_host_lost();
    begin(
        FRAME_NO_SESSION); /* hello in the next tick: both together would make this task's longest run half as long again */
  } else if (identify && send_has_room(MSG_IDENTITY_LENGTH)) {
    identify = false;
    identity_send();
  } else if (hello_in == 0 || --hello_in == 0) {
    say_hello();
  }
}
