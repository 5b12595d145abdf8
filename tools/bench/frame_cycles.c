/* frame_cycles.c: the firmware's frame code against the clock, in place of its main.c: interrupts stay off, the pin of the
 * left servo is high while the code at hand runs. frame_cycles.py builds it, feeds it and reads the pin. */
#include <avr/io.h>

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

/* Receives a message and then does the same without a frame around it: the difference is the frame code's. */
static void receive(uint8_t id, const void *payload, uint8_t length) {
  uint8_t wire[FRAME_SIZE_MAX];
  const uint8_t size = frame_encode(wire, id, 7, payload, length, 0x12345);
  feed(wire, size);
  TIMED(while (hal_serial_due() != 0) link_poll());
  drain();
  TIMED(dispatch(id, 7, payload));
  drain();
}

/* All that a message takes, with its answer. */
static void work_on(uint8_t id, const void *payload, uint8_t length) {
  uint8_t wire[FRAME_SIZE_MAX];
  feed(wire, frame_encode(wire, id, 7, payload, length, 0x12345));
  TIMED(while (hal_serial_due() != 0) link_poll());
  drain();
}

static void send(uint8_t id, const void *payload, uint8_t length) {
  drain();
  TIMED(send_message(id, payload, length));
  drain();
}

int main(void) {
  static uint8_t bytes[MESSAGE_PAYLOAD_MAX_TO_HOST];
  HAL_PIN_OUTPUT(SERVO_LEFT);
  schedule_start(0);
  safety_start();
  hal_start_serial(500000);
  UCSR0B = 0;
  link_start(5000);
  drain();
  link_use_seed(0x12345);
  TIMED(); /* what measuring costs */
  const msg_setpoint_signal setpoint = {5000, -5000, 250, 0x1234};
  receive(MSG_SETPOINT_SIGNAL_ID, &setpoint, sizeof setpoint);
  const msg_setpoint_signal zeros = {0, 0, 0, 0};
  receive(MSG_SETPOINT_SIGNAL_ID, &zeros, sizeof zeros);
  const msg_acknowledge acknowledge = {0x0101};
  receive(MSG_ACKNOWLEDGE_ID, &acknowledge, sizeof acknowledge);
  for (uint8_t fill = 0; fill < 2; fill++) {
    for (uint8_t i = 0; i < sizeof bytes; i++) {
      bytes[i] = fill == 0 ? (uint8_t)(i + 1u) : 0u;
    }
    send(MSG_TELEMETRY_ID, bytes, MSG_TELEMETRY_LENGTH);
    send(MSG_IDENTITY_ID, bytes, MSG_IDENTITY_LENGTH);
    send(MSG_ANSWER_ID, bytes, MSG_ANSWER_LENGTH);
    send(MSG_COUNTERS_ID, bytes, MSG_COUNTERS_LENGTH);
  }
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
