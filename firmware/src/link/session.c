/* session.c: see session.h. */
#include "link/session.h"

#include "hal/hal.h"
#include "link/events.h"
#include "link/frame.h"
#include "link/identity.h"
#include "link/link.h"
#include "link/parameters.h"
#include "link/requests.h"
#include "link/send.h"
#include "link/telemetry.h"
#include "reset.h"
#include "safety.h"
#include "schedule.h"

#define HELLO_PERIOD_ALONE 10u /* ticks */
#define HELLO_PERIOD_OPEN 20u  /* or, if that is longer, */
#define HELLO_TELEMETRIES 4u   /* periods of the telemetry */

static uint32_t seed;        /* of the session; 0: none is open */
static uint32_t board_nonce; /* that the next opening must name */
static uint16_t heard;       /* low half of the tick in which the last frame of the session came */
static uint16_t hello_in;    /* ticks until the next hello; 0: it waits for room */

static uint16_t hello_period(void) {
  if (seed == 0) {
    return HELLO_PERIOD_ALONE;
  }
  const uint16_t longer = HELLO_TELEMETRIES * telemetry_period();
  return longer > HELLO_PERIOD_OPEN ? longer : HELLO_PERIOD_OPEN;
}

/* Says hello now or, where it would leave no room for the next telemetry, in a later tick. */
static void say_hello(void) {
  const bool room = seed == 0 ? hal_serial_room(MSG_HELLO_LENGTH + FRAME_OVERHEAD) : send_has_room(MSG_HELLO_LENGTH);
  hello_in = room && identity_send_hello() ? hello_period() : 0u;
}

/* Begins anew, with a session or, if new_seed is 0, without. */
static void begin(uint32_t new_seed) {
  safety_latch(LATCH_SESSION_ENDED);
  seed = new_seed;
  board_nonce = reset_nonce();
  link_use_seed(new_seed != 0 ? new_seed : FRAME_NO_SESSION);
  send_use_seed(new_seed);
  requests_start();
  events_start();
  telemetry_start();
}

void session_start(void) {
  begin(0);
  say_hello();
}

bool session_open(const msg_open *message) {
  const uint32_t wanted = message->board_nonce ^ message->host_nonce;
  if (wanted == 0 || wanted > FRAME_SEED_MAX || wanted == FRAME_SEED) {
    return false;
  }
  if (wanted != seed) {
    if (message->protocol_version != PROTOCOL_VERSION || message->board_nonce != board_nonce) {
      return false;
    }
    begin(wanted);
    session_heard();
  }
  say_hello();
  return true;
}

bool session_close(uint32_t of) {
  if (of != seed) {
    return false;
  }
  begin(0);
  say_hello();
  return true;
}

uint32_t session_seed(void) { return seed; }

bool session_is_open(void) { return seed != 0; }

uint32_t session_board_nonce(void) { return board_nonce; }

void session_heard(void) { heard = (uint16_t)schedule_tick(); }

static bool host_is_silent(void) {
  const uint16_t ticks = (uint16_t)((uint16_t)schedule_tick() - heard);
  return ticks > parameters_u16(PARAMETER_SESSION_TIME_OUT) / (SCHEDULE_TICK_US / 1000u);
}

void session_task(void) {
  if (seed != 0 && host_is_silent()) {
    begin(0);
    hello_in = 0;
  }
  if (hello_in > 0) {
    hello_in--;
  }
  if (hello_in == 0) {
    say_hello();
  }
}
