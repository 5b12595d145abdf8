/* frame_cycles.c: the firmware's frame code against the clock, in place of its main.c: interrupts stay off, the pin of the
 * left servo is high while the code at hand runs. frame_cycles.py builds it and reads the pin; the order of what is measured
 * is told there too. */
#include <avr/io.h>
#include <string.h>

#include "generated/messages.h"
#include "hal/hal.h"
#include "link/dispatch.h"
#include "link/frame.h"
#include "link/link.h"
#include "link/send.h"
#include "link/session.h"
#include "pins.h"
#include "safety.h"
#include "schedule.h"

#define SEED 0x12345ul
#define SEQUENCE 7u

/* Puts bytes where the receive interrupt would have put them. */
static void feed(const uint8_t *bytes, uint8_t count) {
  for (uint8_t i = 0; i < count; i++) {
    hal_receive_ring[HAL_RECEIVE_HEAD] = bytes[i];
    HAL_RECEIVE_HEAD++;
  }
  hal_serial_again();
}

/* Waits until the sender would have sent everything. */
static void drain(void) { HAL_SEND_TAIL = hal_send_head; }

#define TIMED(what)           \
  do {                        \
    HAL_PIN_HIGH(SERVO_LEFT); \
    what;                     \
    HAL_PIN_LOW(SERVO_LEFT);  \
  } while (0)

/* Gives the board a message as the host would have sent it. The frame is made in the send ring, which is empty. */
static void give(uint8_t id, const void *payload, uint8_t length) {
  drain();
  uint8_t *place = hal_serial_place();
  uint8_t wire[FRAME_SIZE_MAX];
  const uint8_t size = frame_encode(place, id, SEQUENCE, payload, length, SEED);
  for (uint8_t i = 0; i < size; i++) {
    wire[i] = *hal_serial_beyond(place, i);
  }
  feed(wire, size);
}

/* From the ring to an accepted message, without what it asks for. */
static void receive(uint8_t id, const void *payload, uint8_t length) {
  bool accepted = false;
  give(id, payload, length);
  TIMED(accepted = link_take_frame());
  if (!accepted) {
    HAL_PIN_HIGH(SERVO_RIGHT); /* ends the program too early, which frame_cycles.py notices */
  }
}

/* From a message to the ring. */
static void encode(uint8_t id, const void *payload, uint8_t length) {
  drain();
  TIMED(hal_serial_queue(frame_encode(hal_serial_place(), id, SEQUENCE, payload, length, SEED)));
}

/* The same with the sequence number, the question for room and the session's seed. */
static void send(uint8_t id, const void *payload, uint8_t length) {
  drain();
  TIMED(send_message(id, payload, length));
}

/* All that a message takes, with its answer. */
static void work_on(uint8_t id, const void *payload, uint8_t length) {
  give(id, payload, length);
  drain();
  TIMED(while (hal_serial_due() != 0) link_poll());
}

/* Of that, what it asks for. */
static void carry_out(uint8_t id, const void *payload) {
  drain();
  TIMED(dispatch(id, SEQUENCE, payload));
}

int main(void) {
  static uint8_t bytes[MESSAGE_PAYLOAD_MAX_TO_HOST];
  HAL_PIN_OUTPUT(SERVO_LEFT);
  schedule_start(0);
  safety_start();
  hal_start_serial(5000);
  UCSR0B = 0;
  link_start(5000);
  link_use_seed(SEED);
  TIMED(); /* what measuring costs */
#define RECEIVE(id, length, hash) \
  if ((id) < 0x80) {              \
    receive(id, bytes, length);   \
  }
#define ENCODE(id, length, hash) \
  if ((id) >= 0x80) {            \
    encode(id, bytes, length);   \
  }
  for (uint8_t fill = 0; fill < 2; fill++) {
    for (uint8_t i = 0; i < sizeof bytes; i++) {
      bytes[i] = fill == 0 ? (uint8_t)(i + 1u) : 0u;
    }
    MESSAGE_LIST(RECEIVE)
    MESSAGE_LIST(ENCODE)
  }
  encode(MSG_TELEMETRY_ID, bytes, MSG_TELEMETRY_LENGTH);
  send(MSG_TELEMETRY_ID, bytes, MSG_TELEMETRY_LENGTH);
  const msg_acknowledge acknowledge = {0x0101};
  receive(MSG_ACKNOWLEDGE_ID, &acknowledge, sizeof acknowledge);
  work_on(MSG_ACKNOWLEDGE_ID, &acknowledge, sizeof acknowledge);
  carry_out(MSG_ACKNOWLEDGE_ID, &acknowledge);
  work_on(MSG_IDENTIFY_ID, bytes, 0);
  const msg_get_parameter get = {1, 1};
  work_on(MSG_GET_PARAMETER_ID, &get, sizeof get);
  const msg_clock_probe probe = {7};
  work_on(MSG_CLOCK_PROBE_ID, &probe, sizeof probe);
  const msg_open open = {PROTOCOL_VERSION, session_board_nonce(), session_board_nonce() ^ 0x54321ul};
  work_on(MSG_OPEN_ID, &open, sizeof open);
  HAL_PIN_HIGH(SERVO_RIGHT);
  HAL_PIN_OUTPUT(SERVO_RIGHT);
  for (;;) {
  }
}
