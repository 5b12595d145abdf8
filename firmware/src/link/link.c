/* link.c: see link.h. */
#include "link/link.h"

#include <stddef.h>
#include <string.h>

#include "bounds.h"
#include "link/counters.h"
#include "link/devices.h"
#include "link/dispatch.h"
#include "link/frame.h"
#include "link/send.h"
#include "link/session.h"
#include "link/telemetry.h"

static frame_decoder decoder;
uint8_t link_room;

void link_start(uint16_t baud) {
  HAL_ZERO(decoder); /* its seed is the session's to set */
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

/* One piece between delimiters, and an empty one before it. What else waits stays due: so this takes a known time, whatever
 * came. */
bool link_take_frame(void) {
  hal_serial_seen();
  bool ended = false;
  BOUNDED(2, for (uint8_t pieces = 0; pieces < 2u; pieces++)) {
    ended = hal_serial_receive_block(decoder.bytes, &decoder.count, sizeof decoder.bytes);
    if (!ended || decoder.count != 0) {
      break;
    }
    decoder.synchronised = true; /* by an empty frame too */
  }
  if (hal_serial_received()) {
    hal_serial_again();
  }
  return ended && frame_decode_end(&decoder);
}

void link_poll(void) {
  if (hal_serial_due() == 0) {
    return;
  }
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
    hal_serial_again(); /* waits: it stays due */
    return;
  }
  link_room = 0;
  if (!dispatch(frame_id(&decoder), frame_sequence(&decoder), frame_payload(&decoder))) {
    counters_count(refused);
  }
}

/* The three stand in the same order in both. */
#define COUNTS_FROM offsetof(frame_decoder, good)
#define COUNTS_TO offsetof(msg_counters, good)
#define SAME(field) (offsetof(frame_decoder, field) - COUNTS_FROM == offsetof(msg_counters, field) - COUNTS_TO)
_Static_assert(SAME(bad) && SAME(resynchronised), "one copy");

void link_count(msg_counters *into) {
  const uint8_t size = sizeof into->good + sizeof into->bad + sizeof into->resynchronised;
  memcpy((uint8_t *)into + COUNTS_TO, (const uint8_t *)&decoder + COUNTS_FROM, size);
}
