/* send.c: see send.h. */
#include "link/send.h"

#include "hal/hal.h"
#include "link/frame.h"

static uint8_t next_sequence;

void send_start(void) { next_sequence = 0; }

bool send_message(uint8_t id, const void *payload, uint8_t length) {
  const uint8_t sequence = next_sequence++;
  if (!hal_serial_room((uint8_t)(length + FRAME_OVERHEAD))) {
    return false;
  }
  uint8_t wire[FRAME_SIZE_MAX];
  hal_serial_send(wire, frame_encode(wire, id, sequence, payload, length, FRAME_SEED));
  return true;
}
