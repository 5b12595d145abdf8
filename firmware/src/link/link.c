/* link.c: see link.h. */
#include "link/link.h"

#include "hal/hal.h"
#include "link/counter_messages.h"
#include "link/counters.h"
#include "link/devices.h"
#include "link/dispatch.h"
#include "link/frame.h"
#include "link/receive.h"
#include "link/send.h"
#include "link/session.h"
#include "link/telemetry.h"

void link_start(uint16_t baud) {
  receive_start();
  send_start(baud);
  counters_start();
  counter_messages_start();
  telemetry_start_line();
  devices_start_line();
  session_start();
}

void link_poll(void) {
  if (receive_room == 0) {
    if (!receive_frame()) {
      return;
    }
    const uint8_t id = frame_id(&receive_decoder);
    if (!message_is_handshake(id)) {
      session_heard();
    }
    receive_room = dispatch_room(id);
  }
  if (!hal_serial_room(receive_room)) {
    hal_serial_set_due(); /* waits: it stays due */
    return;
  }
  receive_room = 0;
  if (!dispatch(frame_id(&receive_decoder), frame_sequence(&receive_decoder), frame_payload(&receive_decoder))) {
    counters.refused++;
  }
}
