/* link.c: see link.h. */
#include "link/link.h"

#include "hal/hal.h"
#include "link/dispatch.h"
#include "link/frame.h"
#include "link/identity.h"
#include "link/send.h"

static frame_decoder decoder;
static uint8_t refused; /* frames that were whole but asked for what cannot be */

void link_start(void) {
  frame_decoder_start(&decoder, FRAME_SEED);
  refused = 0;
  send_start();
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

uint8_t link_frames_bad(void) { return (uint8_t)(decoder.bad + refused); }
