/* receive.c: see receive.h. */
#include "link/receive.h"

#include "hal/hal.h"
#include "link/counters.h"
#include "tasks.h"

#define POLL_BYTES (FRAME_ACCEPTED_MAX + FRAME_OVERHEAD) /* one frame with both delimiters */
_Static_assert(POLL_BYTES == CONSTANT_poll_bytes, "constants of tasks.def");

frame_decoder receive_decoder;
uint8_t receive_room;

void receive_start(void) {
  frame_decoder_start(&receive_decoder, FRAME_NO_SESSION);
  receive_room = 0;
}

void receive_use_seed(uint32_t seed) {
  frame_decoder_seed(&receive_decoder, seed);
  receive_room = 0; /* a request of the session before is not carried out any more */
}

uint8_t receive_due(void) {
  if (hal_serial_due() == 0) {
    return 0;
  }
  return hal_serial_room(receive_room);
}

/* After a stop of reception, when all that came before it is worked off: what comes next is the middle of a frame. */
static void resume(void) {
  counters_lose_bytes();
  frame_decoder_cut(&receive_decoder);
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
    if (frame_decoder_take(&receive_decoder, byte)) {
      return true;
    }
  }
  return false;
}

bool receive_frame(void) {
  hal_serial_clear_due();
  const bool ended = take_piece();
  if (hal_serial_waiting() || hal_serial_stopped()) {
    hal_serial_set_due();
  }
  return ended && frame_decoder_accept(&receive_decoder);
}

void receive_count(msg_counters *into) {
  into->good = receive_decoder.good;
  into->bad = receive_decoder.bad;
  into->unknown = receive_decoder.unknown;
  into->resynchronised = receive_decoder.resynchronised;
}
