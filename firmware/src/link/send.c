/* send.c: see send.h. */
#include "link/send.h"

#include "clock.h"
#include "hal/hal.h"
#include "link/counters.h"
#include "link/session_seed.h"

#define HALF_MS_PER_BYTE 200u /* 10 bits at 100 bit/s are 100 ms */

static uint8_t next_sequence;
static uint16_t baud_rate; /* 100 bit/s */
static uint8_t wire[FRAME_SIZE_MAX];

void send_start(uint16_t baud) {
  next_sequence = 0;
  baud_rate = baud;
}

bool send_message(uint8_t id, const void *payload, uint8_t length) {
  const uint8_t sequence = next_sequence++;
  if (!hal_serial_room((uint8_t)(length + FRAME_OVERHEAD))) {
    counters.dropped++;
    return false;
  }
  hal_serial_send(wire, frame_encode(wire, id, sequence, payload, length, session_seed()));
  return true;
}

bool send_has_room(uint8_t length) { return hal_serial_room((uint8_t)(length + SEND_RESERVE)); }

uint8_t send_ticks(uint16_t bytes) {
  const uint16_t bits = (uint16_t)(bytes * 10u);
  return (uint8_t)((uint16_t)(bits + baud_rate - 1u) / baud_rate); /* the rate is the bits of a tick */
}
_Static_assert(CLOCK_TICK_RATE == 100u, "a tick's bits are the rate in 100 bit/s");

uint16_t send_half_ms(uint8_t bytes) { return (uint16_t)(bytes * HALF_MS_PER_BYTE) / baud_rate; }
_Static_assert(UINT8_MAX *HALF_MS_PER_BYTE <= UINT16_MAX, "in 16 bits");
