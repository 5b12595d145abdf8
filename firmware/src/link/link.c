/* link.c: see link.h. */
#include "link/link.h"

#include "hal/hal.h"
#include "link/counters.h"
#include "link/devices.h"
#include "link/dispatch.h"
#include "link/frame.h"
#include "link/send.h"
#include "link/session.h"
#include "link/telemetry.h"
#include "tasks.h"

#define POLL_BYTES (FRAME_ACCEPTED_MAX + FRAME_OVERHEAD) /* one frame with both delimiters */
_Static_assert(POLL_BYTES == CONSTANT_poll_bytes, "constants of tasks.def");

static frame_decoder decoder;
uint8_t link_room;

void link_start(uint16_t baud) {
  frame_decoder_start(&decoder, FRAME_NO_SESSION);
  link_room = 0;
  send_start(baud);
  counters_start();
  telemetry_start_line();
  devices_start_line();
  session_start();
}

void link_use_seed(uint32_t seed) {
  frame_decoder_seed(&decoder, seed);
  link_room = 0; /* a request of the session before is not carried out any more */
}

uint8_t link_due(void) {
  if (hal_serial_due() == 0) {
    return 0;
  }
  return hal_serial_room(link_room);
}

/* After a stop of reception, when all that came before it is worked off: what comes next is the middle of a frame. */
static void resume(void) {
  counters_lose_bytes();
  frame_decoder_cut(&decoder);
  hal_serial_resume();
}

/* Takes received bytes, up to the end of a piece or as many as one frame has; true at the end of a piece. So this takes a
 * known time, whatever came. */
static bool take_piece(void) {
  for (uint8_t n = 0; n < POLL_BYTES; n++) {
    uint8_t byte = 0;
    if (!hal_serial_receive(&byte)) {
      if (hal_serial_stopped()) {
        resume();
      }
      return false;
    }
    if (frame_decoder_take(&decoder, byte)) {
      return true;
    }
  }
  return false;
}

bool link_take_frame(void) {
  hal_serial_clear_due();
  const bool ended = take_piece();
  if (hal_serial_waiting() || hal_serial_stopped()) {
    hal_serial_set_due();
  }
  return ended && frame_decoder_accept(&decoder);
}

void link_poll(void) {
  if (link_room == 0) {
    if (!link_take_frame()) {
      return;
    }
    const uint8_t id = frame_id(&decoder);
    if (!message_is_handshake(id)) {
      session_heard();
    }
    link_room = dispatch_room(id);
  }
  if (!hal_serial_room(link_room)) {
    hal_serial_set_due(); /* waits: it stays due */
    return;
  }
  link_room = 0;
  if (!dispatch(frame_id(&decoder), frame_sequence(&decoder), frame_payload(&decoder))) {
    counters.refused++;
  }
}

void link_count(msg_counters *into) {
  into->good = decoder.good;
  into->bad = decoder.bad;
  into->unknown = decoder.unknown;
  into->resynchronised = decoder.resynchronised;
}
