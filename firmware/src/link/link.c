/* link.c: see link.h. */
#include "link/link.h"

#include "hal/hal.h"
#include "link/dispatch.h"
#include "link/frame.h"
#include "link/identity.h"
#include "link/send.h"

static frame_decoder decoder;
bool link_request_waits; /* the decoder holds it */
static uint8_t refused;  /* frames that were whole but asked for what cannot be */

void link_start(void) {
  frame_decoder_start(&decoder, FRAME_SEED);
  link_request_waits = false;
  refused = 0;
  send_start();
  dispatch_start();
  identity_send_hello();
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

void link_poll(void) {
  if (!link_due()) {
    return;
  }
  if (!link_request_waits) {
    if (!take_frame()) {
      return;
    }
    link_request_waits = dispatch_answers(frame_id(&decoder));
    if (!link_due()) {
      return;
    }
  }
  link_request_waits = false;
  if (!dispatch(frame_id(&decoder), frame_sequence(&decoder), frame_payload(&decoder))) {
    refused++;
  }
}

uint8_t link_frames_bad(void) { return (uint8_t)(decoder.bad + refused); }
