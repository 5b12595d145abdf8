/* serial_native.c: the UART and its rings. */
#include "hal/hal.h"
#include "hal/native/events.h"

#define RECEIVE_RING 128u
#define SEND_RING 128u

static uint8_t receive_ring[RECEIVE_RING];
static uint16_t receive_first, receive_count;
static bool stopped; /* the ring was full */
static bool zero_received;
static uint64_t sender_free; /* cycle at which the last queued byte has left */

void native_serial_reset(void) {
  native->baud = NATIVE_BAUD;
  receive_first = receive_count = 0;
  stopped = zero_received = false;
}

void hal_start_serial(uint16_t baud) {
  sender_free = native->now;
  native->baud = 100ul * baud;
}

bool hal_serial_receive(uint8_t *byte) {
  if (receive_count == 0) {
    return false;
  }
  *byte = receive_ring[receive_first];
  receive_first = (uint16_t)((receive_first + 1u) % RECEIVE_RING);
  receive_count--;
  return true;
}

uint8_t hal_serial_due(void) { return zero_received || receive_count >= RECEIVE_RING / 2u || stopped; }

void hal_serial_clear_due(void) { zero_received = false; }

void hal_serial_set_due(void) { zero_received = true; }

bool hal_serial_waiting(void) { return receive_count != 0; }

bool hal_serial_stopped(void) { return stopped; }

void hal_serial_resume(void) { stopped = false; }

bool hal_serial_overrun(void) { return false; }

bool hal_serial_room(uint8_t count) {
  /* Bytes not yet wholly sent are in the ring, but for the one being shifted out. */
  const uint64_t byte_cycles = native_byte_cycles(native->baud);
  const uint64_t queued = sender_free > native->now ? (sender_free - native->now) / byte_cycles : 0;
  if (queued + count <= SEND_RING) {
    return true;
  }
  native_next[EVENT_ROOM] = sender_free - (SEND_RING - (uint64_t)count + 1u) * byte_cycles + 1u;
  return false;
}

void hal_serial_send(const uint8_t *bytes, uint8_t count) {
  const uint64_t start = sender_free > native->now ? sender_free : native->now;
  const uint64_t byte_cycles = native_byte_cycles(native->baud);
  native->transmit(native, start + byte_cycles, bytes, count);
  sender_free = start + count * byte_cycles;
}

void native_byte_arrived(void) {
  native_byte byte = native_take_byte(native);
  native->bytes_in++;
  native->interrupts++;
  if (byte.baud != 0 && native_rates_differ(byte.baud, native->baud)) {
    native->framing_errors++; /* a byte is read all the same; the frame's checksum refuses it */
    byte.byte = native_garbled(byte.byte);
  }
  if (stopped) {
    return;
  }
  zero_received = zero_received || byte.byte == 0;
  if (receive_count == HAL_RECEIVE_MAX) {
    stopped = true;
  } else {
    receive_ring[(receive_first + receive_count) % RECEIVE_RING] = byte.byte;
    receive_count++;
  }
}
