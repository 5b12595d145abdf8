/* serial.c: the UART by interrupts, a ring each way. A byte lasts 320 cycles at 500,000 baud. */
#include "hal/avr/receive_ring.h"

#include "hal/hal.h"

#define DOUBLE_SPEED 8u /* clock cycles per sample with U2X0: at 16 MHz nearer to all rates than 16 are */
#define SEND_RING 128u
#define RECEIVE_DUE ((uint8_t)(SERIAL_RECEIVE_RING / 2u)) /* a bit of the number of bytes that wait */

volatile uint8_t serial_receive_ring[SERIAL_RECEIVE_RING];
volatile uint8_t serial_receive_head, serial_receive_tail, serial_due, serial_overrun;

static volatile uint8_t send_ring[SEND_RING];
static volatile uint8_t send_head; /* the next byte to queue */
static volatile uint8_t send_tail; /* the next one to send; where the head is, none waits */

_Static_assert(HAL_RECEIVE_MAX == SERIAL_RECEIVE_RING - 1u, "one place stays free");

void hal_start_serial(uint16_t baud) {
  UBRR0 = (uint16_t)((uint16_t)(F_CPU / DOUBLE_SPEED / 100u + baud / 2u) / baud - 1u);
  UCSR0A = _BV(U2X0);
  UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
  UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
}

/* ---- receiving ---- */

ISR(USART_RX_vect) { serial_take(UCSR0A); }

uint8_t hal_serial_due(void) {
  const uint8_t waiting = (uint8_t)(serial_receive_head - serial_receive_tail);
  return (uint8_t)(serial_due | (waiting & RECEIVE_DUE));
}

bool hal_serial_waiting(void) { return serial_receive_head != serial_receive_tail; }

void hal_serial_clear_due(void) { serial_due = 0; }

void hal_serial_set_due(void) { serial_due = 1; }

bool hal_serial_receive(uint8_t *byte) {
  const uint8_t tail = serial_receive_tail;
  if (tail == serial_receive_head) {
    return false;
  }
  *byte = serial_receive_ring[tail];
  serial_receive_tail = (uint8_t)(tail + 1u) % SERIAL_RECEIVE_RING;
  return true;
}

bool hal_serial_stopped(void) { return (UCSR0B & _BV(RXCIE0)) == 0; }

/* What the UART has kept meanwhile is the middle of something. */
void hal_serial_resume(void) {
  HAL_ATOMIC {
    UCSR0B = (uint8_t)(UCSR0B | _BV(RXCIE0)); /* first: a byte that comes now asks when it comes, not later */
    (void)UDR0;
    (void)UDR0;
    (void)UDR0;
  }
}

bool hal_serial_overrun(void) {
  const bool lost = serial_overrun != 0;
  serial_overrun = 0;
  return lost;
}

/* ---- sending ---- */

ISR(USART_UDRE_vect) {
  const uint8_t tail = send_tail;
  UDR0 = send_ring[tail];
  const uint8_t next = (uint8_t)(tail + 1u) % SEND_RING;
  send_tail = next;
  if (next == send_head) {
    UCSR0B = (uint8_t)(UCSR0B & (uint8_t)~_BV(UDRIE0));
  }
}

bool hal_serial_room(uint8_t count) {
  const uint8_t queued = (uint8_t)(send_head - send_tail) % SEND_RING;
  return (uint8_t)(queued + count) < SEND_RING;
}

void hal_serial_send(const uint8_t *bytes, uint8_t count) {
  uint8_t head = send_head;
  for (uint8_t i = 0; i < count; i++) {
    LOOP_BOUND(SEND_RING - 1u);
    send_ring[head] = bytes[i];
    head = (uint8_t)(head + 1u) % SEND_RING;
  }
  HAL_ATOMIC { /* the receiver's interrupt writes to this register, too */
    send_head = head;
    if (count != 0) {
      UCSR0B = (uint8_t)(UCSR0B | _BV(UDRIE0));
    }
  }
}
