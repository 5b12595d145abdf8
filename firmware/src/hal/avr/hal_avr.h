/* hal_avr.h: the ATmega328P's part of hal.h that is small enough for inline functions: pins, time, edges.
 *
 *   Timer1  clk/1, free-running; capture for the Ping, compare A for edges, compare B for slots (timers.c)
 *   Timer2  clk/1, CTC: the carrier of the IR bursts (carrier.c)
 *   Timer0  CTC, runs during tones only: the buzzer (tone.c)
 *   PCINT1  port C: stamped changes      PCINT2  port D: the right light sensor or the line sensors
 *   TWI     100 kHz      ADC  clk/128, against the supply */
#ifndef HAL_AVR_H
#define HAL_AVR_H

#include <avr/cpufunc.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <stdbool.h>
#include <stdint.h>
#include <util/atomic.h>

#include "bounds.h"
#include "hal/avr/receive_ring.h"

#define HAL_ATOMIC ATOMIC_BLOCK(ATOMIC_RESTORESTATE)

/* ---- pins ---- */

#define HAL_PIN_BIT(name) ((uint8_t)(1u << name##_BIT))
#define HAL_PIN_HIGH(name) (name##_PORT = (uint8_t)(name##_PORT | HAL_PIN_BIT(name)))
#define HAL_PIN_LOW(name) (name##_PORT = (uint8_t)(name##_PORT & (uint8_t)~HAL_PIN_BIT(name)))
#define HAL_PIN_TOGGLE(name) (name##_PINR = HAL_PIN_BIT(name))
#define HAL_PIN_READ(name) ((uint8_t)((name##_PINR & HAL_PIN_BIT(name)) != 0 ? 1u : 0u))
#define HAL_PIN_RELEASE(name) (name##_DDR = (uint8_t)(name##_DDR & (uint8_t)~HAL_PIN_BIT(name)))
#define HAL_PIN_OUTPUT(name) (name##_DDR = (uint8_t)(name##_DDR | HAL_PIN_BIT(name)))
#define HAL_PIN_INPUT(name) (HAL_PIN_RELEASE(name), HAL_PIN_LOW(name))
#define HAL_PIN_PULL_UP(name) (HAL_PIN_RELEASE(name), HAL_PIN_HIGH(name))
#define HAL_PORT_C() (PINC)

/* ---- constant tables in flash ---- */

#define HAL_TABLE static const __attribute__((__progmem__))
static inline uint16_t hal_table_word(const uint16_t *word) { return pgm_read_word(word); }
static inline void hal_table_copy(void *to, const void *from, uint8_t size) { memcpy_P(to, from, size); }

/* ---- time ---- */

/* The two halves of the count share a latch, so that nobody may come in between. */
HAL_INLINE uint16_t hal_time(void) { return TCNT1; }

#define hal_wait(cycles) __builtin_avr_delay_cycles(cycles)

HAL_INLINE void hal_slot_arm(uint16_t time) { OCR1B = time; }

/* In QEMU no SLEEP ends; there SMCR keeps nothing that is written to it. */
HAL_INLINE bool hal_sleeps(void) { return (SMCR & _BV(SE)) != 0; }

/* `sei` lets no interrupt in before the next instruction: none slips in between the question and the sleep. Behind each
 * interrupt one instruction runs (data sheet, 7.7): five, so that those that wait come in turn before interrupts are off
 * again. Without them a byte may wait for the whole of an IR burst. */
HAL_INLINE void hal_sleep(void) {
  sei();
  sleep_cpu();
  _NOP();
  _NOP();
  _NOP();
  _NOP();
  _NOP();
  cli();
}

/* ---- exact edges ---- */

/* The lead covers all that may keep the edge's interrupt waiting, its latency in tasks.def, and what it does up to its
 * first look at the time. `boebot timing` proves both. */
enum {
#define INTERRUPT(name, vector, budget, latency, interval) HAL_LATENCY_##name = (latency),
#include "tasks.def"
};
#define HAL_EDGE_PROLOGUE 110u /* cycles of it, with the registers that are saved before */
#define HAL_EDGE_LEAD ((uint16_t)HAL_LATENCY_edge + HAL_EDGE_PROLOGUE)
#define HAL_EDGE_CLOSE 110u /* cycles before it from which nothing else is done: longer than a turn that takes a byte */
_Static_assert(HAL_EDGE_CLOSE < 128u, "then the low byte of the count is enough");

HAL_INLINE void hal_edge_arm(uint16_t time) {
  OCR1A = (uint16_t)(time - HAL_EDGE_LEAD);
  TIFR1 = _BV(OCF1A);
  TIMSK1 = (uint8_t)(TIMSK1 | _BV(OCIE1A));
}

HAL_INLINE void hal_edge_disarm(void) { TIMSK1 = (uint8_t)(TIMSK1 & (uint8_t)~_BV(OCIE1A)); }

/* Far from it received bytes are read, for the receiver holds only two. The last turns look at the low byte of the
 * count alone, 8 cycles each. */
HAL_INLINE uint16_t hal_edge_wait(uint16_t time) {
  uint16_t left = (uint16_t)(time - TCNT1);
  if ((int16_t)left <= 0) {
    return (uint16_t)-left;
  }
  while (left > HAL_EDGE_CLOSE) {
    LOOP_CYCLES(HAL_EDGE_LEAD - HAL_EDGE_CLOSE);
    hal_serial_take_waiting();
    left = (uint16_t)(time - TCNT1);
  }
  while ((int8_t)((uint8_t)time - TCNT1L) > 0) {
    LOOP_CYCLES(HAL_EDGE_CLOSE);
  }
  return 0;
}

/* ---- capture ---- */

HAL_INLINE void hal_capture_start(void) {
  TCCR1B = _BV(ICES1) | _BV(CS10);
  TIFR1 = _BV(ICF1);
  TIMSK1 = (uint8_t)(TIMSK1 | _BV(ICIE1));
}

HAL_INLINE void hal_capture_falling(void) {
  TCCR1B = _BV(CS10);
  TIFR1 = _BV(ICF1);
}

HAL_INLINE void hal_capture_start_falling(void) {
  hal_capture_falling();
  TIMSK1 = (uint8_t)(TIMSK1 | _BV(ICIE1));
}

HAL_INLINE void hal_capture_stop(void) { TIMSK1 = (uint8_t)(TIMSK1 & (uint8_t)~_BV(ICIE1)); }

/* ---- pin changes ---- */

HAL_INLINE void hal_watch_port_c(uint8_t bits) {
  if (bits != 0 && PCMSK1 == 0) {
    PCIFR = _BV(PCIF1);
  }
  PCMSK1 = bits;
}

HAL_INLINE void hal_watch_port_d(uint8_t bits) {
  PCMSK2 = 0;
  PCIFR = _BV(PCIF2);
  PCMSK2 = bits;
}

#endif
