/* link.c: see link.h. */
#include "link/link.h"

#include "hal/hal.h"
#include "link/dispatch.h"
#include "link/frame.h"
#include "link/identity.h"

static frame_decoder decoder;
static uint8_t next_sequence;
static uint8_t refused; /* frames that were whole but asked for what cannot be */

void link_start(void) {
  frame_decoder_start(&decoder, FRAME_SEED);
  next_sequence = 0;
  refused = 0;
  dispatch_start();
  identity_send_hello();
}

void link_poll(void) {
  if (!link_due()) {
    return;
  }
  uint8_t byte = 0;
  while (hal_serial_receive(&byte)) {
    if (frame_decode(&decoder, byte)) {
      if (!dispatch(frame_id(&decoder), frame_sequence(&decoder), frame_payload(&decoder))) {
        refused++;
      }
      return;
    }
  }
}

bool link_send(uint8_t id, const void *payload, uint8_t length) {
  const uint8_t sequence = next_sequence++;
  if (!hal_serial_room((uint8_t)(length + FRAME_OVERHEAD))) {
    return false;
  }
  uint8_t wire[FRAME_SIZE_MAX];
  hal_serial_send(wire, frame_encode(wire, id, sequence, payload, length, decoder.seed));
  return true;
}

uint8_t link_frames_bad(void) { return (uint8_t)(decoder.bad + refused); }
