/* send.c: see send.h. */
#include "link/send.h"

#include "link/counters.h"

static uint8_t next_sequence;
static uint16_t baud_rate; /* 100 bit/s */
static uint32_t session_seed;

void send_start(uint16_t baud) {
  next_sequence = 0;
  baud_rate = baud;
  session_seed = FRAME_SEED;
}

void send_use_seed(uint32_t seed) { session_seed = seed; }

bool send_message(uint8_t id, const void *payload, uint8_t length) {
  const uint8_t sequence = next_sequence++;
  if (!hal_serial_room((uint8_t)(length + FRAME_OVERHEAD))) {
    counters.dropped++;
    return false;
  }
  uint8_t wire[FRAME_SIZE_MAX];
  hal_serial_send(wire, frame_encode(wire, id, sequence, payload, length, session_seed));
  return true;
}

uint32_t send_time(uint16_t bytes) { return (uint32_t)bytes * UINT32_C(100000) / baud_rate; /* 10 bits each */ }
