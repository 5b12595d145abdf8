/* receive_ring.h: the receiver's ring, in line for its own interrupt and for those that take a byte on their way: the UART holds two
 * bytes and the one that comes in, and an interrupt that waits for an exact edge keeps the receiver's waiting for longer. */
#ifndef HAL_AVR_RECEIVE_RING_H
#define HAL_AVR_RECEIVE_RING_H

#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>

#define SERIAL_RECEIVE_RING 128u

extern volatile uint8_t serial_receive_ring[SERIAL_RECEIVE_RING];
extern volatile uint8_t serial_receive_head; /* the next byte goes there: that place is always free */
extern volatile uint8_t serial_receive_tail; /* the oldest byte; where the head is, none waits */
extern volatile uint8_t serial_due;          /* not 0: a zero byte has come, or the ring is full */
extern volatile uint8_t serial_overrun;      /* not 0: the UART has lost a byte */

/* Takes the byte that waits, with interrupts off. When the ring is full, its interrupt switches itself off: so line and
 * encoders together never take all the time. */
static inline __attribute__((always_inline)) void serial_take(uint8_t status) {
  const uint8_t byte = UDR0;
  const uint8_t head = serial_receive_head;
  serial_receive_ring[head] = byte;
  const uint8_t next = (uint8_t)(head + 1u) % SERIAL_RECEIVE_RING;
  if (next == serial_receive_tail) {
    UCSR0B = (uint8_t)(UCSR0B & (uint8_t)~_BV(RXCIE0));
    serial_due = 1;
  } else {
    serial_receive_head = next;
  }
  if (byte == 0) {
    serial_due = 1;
  }
  if ((status & _BV(DOR0)) != 0) {
    serial_overrun = 1;
  }
}

/* Takes a byte if one waits and its interrupt is on. */
static inline __attribute__((always_inline)) void hal_serial_take_waiting(void) {
  const uint8_t status = UCSR0A;
  if ((status & _BV(RXC0)) != 0 && (UCSR0B & _BV(RXCIE0)) != 0) {
    serial_take(status);
  }
}

#endif
