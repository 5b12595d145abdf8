/* link.c: see link.h. */
#include "link/link.h"

#include "link/counters.h"
#include "link/dispatch.h"
#include "link/frame.h"
#include "link/send.h"
#include "link/session.h"
#include "link/telemetry.h"

static frame_decoder decoder;
uint8_t link_room;

void link_start(uint16_t baud) {
  frame_decoder_start(&decoder, FRAME_NO_SESSION);
  link_room = 0;
  send_start(baud);
  counters_start();
  telemetry_start_line();
  session_start();
}

void link_use_seed(uint32_t seed) {
  decoder.seed = seed;
  link_room = 0; /* a request of the session before is not carried out any more */
}

/* Takes bytes up to the end of a frame; false if they end before. */
static bool take_frame(void) {
  uint8_t byte = 0;
  hal_serial_seen();
  while (hal_serial_receive(&byte)) {
    if (frame_decode(&decoder, byte)) {
      hal_serial_again();
      return true;
    }
  }
  return false;
}

/* Room for a message's answer and the next telemetry; 0: it waits for none. */
static uint8_t room_for(uint8_t id) {
  const int8_t length = dispatch_answer_length(id);
  return length < 0 ? 0u : SEND_ROOM((uint8_t)length);
}

void link_poll(void) {
  if (!link_due()) {
    return;
  }
  const uint8_t *payload = frame_payload(&decoder);
  if (link_room == 0) {
    if (!take_frame()) {
      return;
    }
    const uint8_t id = frame_id(&decoder);
    if (!message_is_handshake(id)) {
      session_heard();
    }
    link_room = room_for(id);
    if (!link_due()) {
      return;
    }
  }
  link_room = 0;
  if (!dispatch(frame_id(&decoder), frame_sequence(&decoder), payload)) {
    counters.refused++;
  }
}

void link_count(msg_counters *into) {
  into->good = decoder.good;
  into->bad = decoder.bad;
  into->resynchronised = decoder.resynchronised;
}
