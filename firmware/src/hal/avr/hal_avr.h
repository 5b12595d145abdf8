/* hal_avr.h: the ATmega328P; see hal/hal.h for what each of these means.
 *
 *   Timer1  clk/1, free-running; capture for the Ping, compare A for edges, compare B for slots
 *   Timer2  clk/1, CTC, runs during IR bursts only: the carrier
 *   Timer0  CTC, runs during tones only: compare A toggles the buzzer
 *   PCINT1  the encoders' port      PCINT2  port D: one stamped change
 *   TWI     100 kHz      ADC  clk/128, against the supply
 *   GPIOR0  bit 0, 1: the carrier toggles the left, right LED; bit 2: received bytes were lost; bit 3: pin
 *           changes were stopped; bit 4: a zero byte was received; bit 5: the watchdog has run out
 *   GPIOR1  head of the receive ring      OCR0B  its tail      GPIOR2  tail of the send ring
 *           (one-cycle access in the interrupts; Timer0 never needs its second compare value)
 */
#ifndef HAL_AVR_H
#define HAL_AVR_H

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <stdbool.h>
#include <stdint.h>
#include <util/atomic.h>

#include "bounds.h"

/* Interrupts stand near the vectors, whose jumps then take a cycle less. Those that come most are written out, and need not
 * save what they use: the registers r2 to r7 are theirs alone, for the compiler is told to leave them (platformio.ini).
 *   r2  0      r3  scratch, and UCSR0A for who jumps to hal_receive_rest      r4, r5  Z      r6  SREG      r7  scratch */
#define HAL_BY_VECTORS __attribute__((section(".lowtext")))
#define HAL_ISR(vector) ISR(vector, ISR_NAKED HAL_BY_VECTORS)
#define HAL_INTERRUPT_SLOT ISR(TIMER1_COMPB_vect, HAL_BY_VECTORS)
#define HAL_INTERRUPT_EDGE ISR(TIMER1_COMPA_vect, HAL_BY_VECTORS)
#define HAL_INTERRUPT_CAPTURE ISR(TIMER1_CAPT_vect, HAL_BY_VECTORS)
#define HAL_INTERRUPT_WATCHDOG ISR(WDT_vect)

/* Runs with interrupts on; that of the EEPROM itself is off until asked for again (eeprom_avr.c). */
#define HAL_INTERRUPT_EEPROM                                                            \
  void __vector_eeprom_body(void) __attribute__((interrupt, used, externally_visible)); \
  void __vector_eeprom_body(void)

/* The same for the two-wire bus (two_wire_avr.c). */
#define HAL_INTERRUPT_TWO_WIRE                                                            \
  void __vector_two_wire_body(void) __attribute__((interrupt, used, externally_visible)); \
  void __vector_two_wire_body(void)

/* A variable that assembly names: the optimisation of the whole program keeps it, and its name. */
#define HAL_NAMED __attribute__((used, externally_visible))

/* The compiler shall not see that it is a constant. */
#define HAL_NEAR(pointer)                  \
  ({                                       \
    __typeof__(pointer) near_ = (pointer); \
    __asm__("" : [near_] "+b"(near_));     \
    near_;                                 \
  })
#define HAL_ZERO(variable) ((void)0) /* the start-up code has done it */

#if __GNUC__ > 7 /* would make functions of these two, after which it cannot be told whether interrupts are on */
static inline uint8_t __iCliRetVal(void) __attribute__((always_inline));
static inline void __iRestore(const uint8_t *) __attribute__((always_inline));
#endif
#define HAL_ATOMIC ATOMIC_BLOCK(ATOMIC_RESTORESTATE)

/* The timing table's columns, for this board's code and its assertions. */
enum {
#define INTERRUPT(name, vector, budget, latency, interval) \
  HAL_VECTOR_##name = (vector), HAL_BUDGET_##name = (budget), HAL_LATENCY_##name = (latency),
#include "tasks.def"
};

/* Covers what can stand before the edge's interrupt, its latency in the table, which the analysis of the image shows for
 * both loads; also, as they mostly are, one that has begun, a storm of pin changes (5 x 81 and 12 to stop it), a stamped
 * change and a capture; and its own prologue up to the reading of the time. */
#define HAL_STORM_CYCLES ((HAL_CHANGES_STORM + 1u) * 81u + 12u)
_Static_assert(HAL_BUDGET_receive + HAL_STORM_CYCLES + HAL_BUDGET_stamp + HAL_BUDGET_capture <= HAL_LATENCY_edge,
               "lead");
#define HAL_EDGE_PROLOGUE 65u
#define HAL_EDGE_LEAD ((uint16_t)HAL_LATENCY_edge + HAL_EDGE_PROLOGUE)
#define HAL_EDGE_CLOSE 70u /* cycles before it from which nothing else is done */
#define HAL_EDGE_TAKES 35u /* from the time given to hal_edge_wait() to the reading in hal_edge_delay(), if punctual */

#define HAL_PIN_BIT(name) ((uint8_t)(1u << name##_BIT))
#define HAL_PIN_OUTPUT(name) (name##_DDR = (uint8_t)(name##_DDR | HAL_PIN_BIT(name)))
#define HAL_PIN_INPUT(name) (HAL_PIN_MAKE_INPUT(name), HAL_PIN_LOW(name))
#define HAL_PIN_PULL_UP(name) (HAL_PIN_MAKE_INPUT(name), HAL_PIN_HIGH(name))
#define HAL_PIN_MAKE_INPUT(name) (name##_DDR = (uint8_t)(name##_DDR & (uint8_t)~HAL_PIN_BIT(name)))
#define HAL_PIN_HIGH(name) (name##_PORT = (uint8_t)(name##_PORT | HAL_PIN_BIT(name)))
#define HAL_PIN_LOW(name) (name##_PORT = (uint8_t)(name##_PORT & (uint8_t)~HAL_PIN_BIT(name)))
#define HAL_PIN_TOGGLE(name) (name##_PINR = HAL_PIN_BIT(name))
#define HAL_PORT_READ(name) (name##_PINR)
#define HAL_PORT_C() (PINC)
#define HAL_PIN_READ(name) ((uint8_t)((name##_PINR & HAL_PIN_BIT(name)) != 0 ? 1u : 0u))

#define HAL_TABLE static const __attribute__((__progmem__))
static inline uint8_t hal_table_byte(const uint8_t *byte) { return pgm_read_byte(byte); }
static inline uint16_t hal_table_word(const uint16_t *word) { return pgm_read_word(word); }
static inline void hal_table_copy(void *to, const void *from, uint8_t size) { memcpy_P(to, from, size); }

/* Interrupt context or HAL_ATOMIC: the two halves of the count share a latch. */
static inline uint16_t hal_time(void) { return TCNT1; }

static inline void hal_slot_arm(uint16_t time) { OCR1B = time; }

static inline void hal_edge_arm_plain(uint16_t time) {
  OCR1A = time;
  TIFR1 = _BV(OCF1A);
  TIMSK1 = (uint8_t)(TIMSK1 | _BV(OCIE1A));
}

static inline void hal_edge_arm(uint16_t time) { hal_edge_arm_plain((uint16_t)(time - HAL_EDGE_LEAD)); }

static inline void hal_edge_disarm(void) { TIMSK1 = (uint8_t)(TIMSK1 & (uint8_t)~_BV(OCIE1A)); }

static inline uint16_t hal_capture_time(void) { return ICR1; }

static inline void hal_capture_falling(void) {
  TCCR1B = _BV(CS10);
  TIFR1 = _BV(ICF1);
}

static inline __attribute__((always_inline)) void hal_capture_stop(void) {
  TIMSK1 = (uint8_t)(TIMSK1 & (uint8_t)~_BV(ICIE1));
}

/* The place at that low byte in a ring that begins at a multiple of 256. */
#define HAL_RING_PLACE(place, ring, low) __asm__("mov %A0, %1 \n ldi %B0, hi8(" #ring ")" : "=&d"(place) : "r"(low))

static inline __attribute__((always_inline)) volatile hal_change *hal_change_at(uint8_t index) {
  volatile hal_change *place;
  HAL_RING_PLACE(place, hal_changes, index);
  return place;
}

#define HAL_STOPPED_BIT 3 /* of GPIOR0 */
static inline uint8_t hal_changes_stopped(void) { return GPIOR0 & _BV(HAL_STOPPED_BIT); }
static inline void hal_changes_resume(void) { GPIOR0 = (uint8_t)(GPIOR0 & (uint8_t)~_BV(HAL_STOPPED_BIT)); }

static inline void hal_pin_change_mask(uint8_t bits) {
  if (PCMSK1 == 0) {
    PCIFR = _BV(PCIF1);
  }
  PCMSK1 = bits;
}

/* One stamped change of port D (stamp_avr.c): its interrupt empties the mask. */
extern volatile uint8_t hal_stamp_slot;
extern volatile uint16_t hal_stamp_time;

static inline void hal_stamp_disarm(void) { PCMSK2 = 0; }

static inline void hal_stamp_arm(uint8_t bits) {
  hal_stamp_disarm();
  PCIFR = _BV(PCIF2);
  PCMSK2 = bits;
}

static inline bool hal_stamp_awaited(void) { return PCMSK2 != 0; }

/* Two-wire bus (data sheet, 22). In its interrupt's body other interrupts are on and its own is off; the command that ends
 * the body switches its own on again with the others off, so that it does not come before the body has returned. */
#define HAL_TWO_WIRE_RATE ((F_CPU / 100000u - 16u) / 2u)

static inline void hal_two_wire_on(void) {
  TWSR = 0;
  TWBR = HAL_TWO_WIRE_RATE;
  TWCR = _BV(TWEN);
}
static inline void hal_two_wire_off(void) { TWCR = 0; }
static inline __attribute__((always_inline)) void hal_two_wire_command(uint8_t bits) {
  cli(); /* until the body returns; whoever is no interrupt calls from within HAL_ATOMIC */
  TWCR = (uint8_t)(_BV(TWINT) | _BV(TWEN) | bits);
}
static inline void hal_two_wire_begin(void) { hal_two_wire_command(_BV(TWSTA) | _BV(TWIE)); }
static inline void hal_two_wire_send(uint8_t byte) {
  TWDR = byte;
  hal_two_wire_command(_BV(TWIE));
}
static inline void hal_two_wire_receive(bool more) {
  hal_two_wire_command(more ? (uint8_t)(_BV(TWIE) | _BV(TWEA)) : (uint8_t)_BV(TWIE));
}
static inline void hal_two_wire_end(void) { hal_two_wire_command(_BV(TWSTO)); }
static inline uint8_t hal_two_wire_status(void) { return TWSR & 0xF8u; }
static inline uint8_t hal_two_wire_byte(void) { return TWDR; }

/* EEPROM (data sheet, 8.6). */
#define HAL_EEPROM_SIZE 1024u
/* 26,368 periods of the RC oscillator (table 8-1), whose 8 MHz may be 10 % less (table 29-1). */
#define HAL_EEPROM_WRITE_CYCLES (26368ul * (F_CPU / 100000ul) / 72ul)
static inline bool hal_eeprom_busy(void) { return (EECR & _BV(EEPE)) != 0; }

static inline void hal_eeprom_wait(void) {
  BOUNDED_TIME(HAL_EEPROM_WRITE_CYCLES, while (hal_eeprom_busy())) {
  }
}

static inline uint8_t hal_eeprom_read(uint16_t address) {
  EEAR = address;
  EECR |= _BV(EERE);
  return EEDR;
}

/* EEPE must follow EEMPE within four cycles: two single instructions with nothing in between. */
static inline void hal_eeprom_write_start(uint16_t address, uint8_t value) {
  EEAR = address;
  EEDR = value;
  HAL_ATOMIC {
    EECR |= _BV(EEMPE);
    EECR |= _BV(EEPE);
  }
}

static inline __attribute__((always_inline)) void hal_eeprom_interrupt(bool on) {
  if (on) {
    EECR |= _BV(EERIE);
  } else {
    EECR = (uint8_t)(EECR & (uint8_t)~_BV(EERIE));
  }
}

/* The rings of serial_avr.c: 256 bytes from a multiple of 256 on, 128 from a multiple of 128 on. Heads and tails are low
 * bytes of addresses; equal ones: empty. */
#define HAL_SEND_RING 128u
#define HAL_SEND_MASK (HAL_SEND_RING - 1u)
#define HAL_RECEIVE_HEAD GPIOR1
#define HAL_RECEIVE_TAIL OCR0B
#define HAL_SEND_TAIL GPIOR2
extern uint8_t hal_receive_ring[256];
extern uint8_t hal_send_ring[HAL_SEND_RING];
extern volatile uint8_t hal_send_head;

#define HAL_LOST_BIT 2 /* of GPIOR0 */
#define HAL_ZERO_BIT 4

/* Takes a received byte, if one waits, as the receive interrupt would, in code that keeps it waiting: 4 cycles if not. */
void hal_serial_take(void);
static inline __attribute__((always_inline)) void hal_serial_look(void) {
  __asm__ volatile(
      "lds r3, %[status]         \n"
      "sbrc r3, %[received]      \n"
      "call hal_serial_take      \n"
      :
      : [status] "n"(_SFR_MEM_ADDR(UCSR0A)), [received] "I"(RXC0)
      : "memory");
}

#define HAL_RECEIVE_DUE 64u /* bytes, a power of two: a quarter of the ring */
static inline uint8_t hal_serial_due(void) {
  return (uint8_t)((GPIOR0 & _BV(HAL_ZERO_BIT)) |
                   ((uint8_t)(HAL_RECEIVE_HEAD - HAL_RECEIVE_TAIL) & (uint8_t) ~(HAL_RECEIVE_DUE - 1u)));
}

static inline void hal_serial_seen(void) { GPIOR0 = (uint8_t)(GPIOR0 & (uint8_t)~_BV(HAL_ZERO_BIT)); }

static inline void hal_serial_again(void) { GPIOR0 |= _BV(HAL_ZERO_BIT); }

static inline bool hal_serial_received(void) { return HAL_RECEIVE_HEAD != HAL_RECEIVE_TAIL; }

/* Bytes that wait. A full ring may have lost some. */
static inline __attribute__((always_inline)) uint8_t hal_serial_waiting(void) {
  const uint8_t waiting = (uint8_t)(HAL_RECEIVE_HEAD - HAL_RECEIVE_TAIL);
  if (waiting == UINT8_MAX) {
    GPIOR0 |= _BV(HAL_LOST_BIT);
  }
  return waiting;
}

static inline bool hal_serial_receive(uint8_t *byte) {
  const uint8_t tail = HAL_RECEIVE_TAIL;
  if (hal_serial_waiting() == 0) {
    return false;
  }
  *byte = hal_receive_ring[tail];
  HAL_RECEIVE_TAIL = (uint8_t)(tail + 1u);
  return true;
}

/* 10 cycles a byte. */
static inline __attribute__((always_inline)) bool hal_serial_receive_block(uint8_t *bytes, uint8_t *count,
                                                                           uint8_t size) {
  const uint8_t tail = HAL_RECEIVE_TAIL;
  uint8_t left = hal_serial_waiting();
  if (left == 0) {
    return false;
  }
  uint8_t *from;
  HAL_RING_PLACE(from, hal_receive_ring, tail);
  uint8_t *to = bytes + *count;
  uint8_t room = (uint8_t)(size - *count);
  const bool is_full = room == 1u;
  if (is_full) { /* what is too long is no message: it need not be kept */
    to = bytes;
    room = size;
  }
  if (left > room) {
    left = room;
  }
  uint8_t byte;
  __asm__ volatile(
      "1: ld %[byte], %a[from]   \n" BOUNDED_ASM("%[size]")
      "inc %A[from]              \n"
      "st %a[to]+, %[byte]       \n"
      "tst %[byte]               \n"
      "breq 2f                   \n"
      "dec %[left]               \n"
      "brne 1b                   \n"
      "2:                        \n"
      : [to] "+x"(to), [from] "+z"(from), [left] "+r"(left), [byte] "=&r"(byte)
      : [size] "n"(size)
      : "memory");
  HAL_RECEIVE_TAIL = (uint8_t)(uintptr_t)from;
  uint8_t filled = (uint8_t)(to - bytes);
  if (byte == 0 || filled == size) { /* without the zero; or the last place again */
    filled--;
  }
  *count = is_full ? (uint8_t)(size - 1u) : filled;
  return byte == 0;
}

static inline bool hal_serial_room(uint8_t count) {
  const uint8_t queued = (uint8_t)((uint8_t)(hal_send_head - HAL_SEND_TAIL) & HAL_SEND_MASK);
  return (uint8_t)(queued + count) < HAL_SEND_RING;
}

static inline __attribute__((always_inline)) uint8_t *hal_serial_place(void) {
  uint8_t *place;
  HAL_RING_PLACE(place, hal_send_ring, hal_send_head);
  return place;
}

/* Brings the low byte of an address in the register pair of that name back into the send ring. */
#define HAL_SEND_WRAP(pair) \
  "andi %A[" #pair          \
  "], %[mask] \n"           \
  "ori %A[" #pair "], lo8(hal_send_ring) \n"

static inline __attribute__((always_inline)) uint8_t *hal_serial_beyond(uint8_t *place, uint8_t count) {
  __asm__("add %A[place], %[count] \n" HAL_SEND_WRAP(place)
          : [place] "+d"(place)
          : [count] "r"(count), [mask] "M"(HAL_SEND_MASK));
  return place;
}

static inline __attribute__((always_inline)) void hal_serial_put(uint8_t **place, uint8_t byte) {
  __asm__ volatile("st %a[place], %[byte] \n inc %A[place] \n" HAL_SEND_WRAP(place)
                   : [place] "+e"(*place)
                   : [byte] "r"(byte), [mask] "M"(HAL_SEND_MASK)
                   : "memory");
}

static inline __attribute__((always_inline)) void hal_serial_put_before(uint8_t **place, uint8_t byte) {
  __asm__ volatile("dec %A[place] \n" HAL_SEND_WRAP(place) "st %a[place], %[byte] \n"
                   : [place] "+e"(*place)
                   : [byte] "r"(byte), [mask] "M"(HAL_SEND_MASK)
                   : "memory");
}

void hal_serial_queue(uint8_t count);

/* Returns a fixed number of cycles after the timer has read `time`, whenever it was called. Far from it, received bytes
 * are taken meanwhile, for the receiver holds two and no more. Then, within HAL_EDGE_CLOSE cycles of it, the fine loop
 * takes the rest three by three, the branches after it the last 0 to 2. */
static inline __attribute__((always_inline)) void hal_edge_wait(uint16_t time) {
  BOUNDED_TIME(HAL_EDGE_LEAD - HAL_EDGE_CLOSE, while ((int16_t)(time - TCNT1) > (int16_t)HAL_EDGE_CLOSE)) {
    hal_serial_look();
  }
  uint16_t left;
  __asm__ volatile(
      "1: movw %A[left], %A[time]       \n" BOUNDED_ASM("1")
      "   lds __tmp_reg__, %[low]       \n" /* also latches the high byte */
      "   sub %A[left], __tmp_reg__     \n"
      "   lds __tmp_reg__, %[high]      \n"
      "   sbc %B[left], __tmp_reg__     \n"
      "   brmi 5f                       \n" /* late */
      "   tst %B[left]                  \n"
      "   brne 1b                       \n"
      "2: subi %A[left], 3              \n" BOUNDED_ASM("%[fine]")
      "   brcc 2b                       \n"
      "   cpi %A[left], 0xFE            \n" /* -3, -2 or -1 remain: 0, 1 or 2 cycles more */
      "   brcc 3f                       \n"
      "3: cpi %A[left], 0xFF            \n"
      "   brcc 5f                       \n"
      "5:                               \n"
      : [left] "=&d"(left)
      : [time] "r"(time), [low] "n"(_SFR_MEM_ADDR(TCNT1L)), [high] "n"(_SFR_MEM_ADDR(TCNT1H)),
        [fine] "n"(HAL_EDGE_CLOSE / 3u + 1u));
}

static inline uint16_t hal_edge_delay(uint16_t time) {
  const uint16_t delay = (uint16_t)(TCNT1 - time - HAL_EDGE_TAKES);
  return delay < 0x8000u && delay > 4u ? delay : 0u;
}

static inline __attribute__((always_inline)) void hal_sleep_until(bool (*due)(void)) {
  cli();
  while (!due()) {
    sei(); /* takes effect after the next instruction: no interrupt slips in before the sleep */
    sleep_cpu();
    /* One instruction runs after each interrupt (data sheet, 7.7): those that wait by now come in turn, before due() is
     * asked again with interrupts off. */
    __asm__ volatile("nop\n nop\n nop\n nop\n nop" ::: "memory");
    cli();
  }
  sei();
}

#endif
