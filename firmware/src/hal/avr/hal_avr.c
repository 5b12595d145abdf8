/* hal_avr.c: timers, carrier, tone, Ping trigger and image of the ATmega328P. */
#include "bounds.h"
#include "hal/hal.h"
#include "pins.h"

#if F_CPU != 16000000UL
#error "the board runs at 16 MHz"
#endif

#define IS_VECTOR(name, vector) _Static_assert(HAL_VECTOR_##name == vector##_num, "tasks.def: vector of " #name)
IS_VECTOR(changes, PCINT1_vect);
IS_VECTOR(stamp, PCINT2_vect);
IS_VECTOR(watchdog, WDT_vect);
IS_VECTOR(carrier, TIMER2_COMPA_vect);
IS_VECTOR(capture, TIMER1_CAPT_vect);
IS_VECTOR(edge, TIMER1_COMPA_vect);
IS_VECTOR(slot, TIMER1_COMPB_vect);
IS_VECTOR(tone, TIMER0_COMPA_vect);
IS_VECTOR(receive, USART_RX_vect);
IS_VECTOR(send, USART_UDRE_vect);
IS_VECTOR(eeprom, EE_READY_vect);
IS_VECTOR(two_wire, TWI_vect);

#define PING_TRIGGER_CYCLES (5u * HAL_CYCLES_PER_US)

void hal_start_timers(void) {
  TCCR2A = _BV(WGM21);
  PCICR = _BV(PCIE1) | _BV(PCIE2);
  SMCR = _BV(SE); /* idle: timers and UART go on */

  TCCR1A = 0;
  TCCR1B = 0;
  TCNT1 = 0;
  hal_slot_arm(HAL_SLOT_CYCLES);
  TIFR1 = _BV(OCF1B);
  TIMSK1 = _BV(OCIE1B);
  TCCR1B = _BV(CS10);
  sei();
}

/* ---- IR carrier ---- */

enum { CARRIER_LEFT = 0, CARRIER_RIGHT = 1 }; /* bits of GPIOR0 */

/* Toggles the LEDs that GPIOR0 names, 13 cycles with entry and return; neither flags nor registers change. */
HAL_ISR(TIMER2_COMPA_vect) {
  __asm__ volatile(
      "sbic %[which], %[left]            \n"
      "sbi %[left_pin], %[left_bit]      \n"
      "sbic %[which], %[right]           \n"
      "sbi %[right_pin], %[right_bit]    \n"
      "reti                              \n"
      :
      : [which] "I"(_SFR_IO_ADDR(GPIOR0)), [left] "I"(CARRIER_LEFT), [right] "I"(CARRIER_RIGHT),
        [left_pin] "I"(_SFR_IO_ADDR(INFRARED_LEFT_LED_PINR)), [left_bit] "I"(INFRARED_LEFT_LED_BIT),
        [right_pin] "I"(_SFR_IO_ADDR(INFRARED_RIGHT_LED_PINR)), [right_bit] "I"(INFRARED_RIGHT_LED_BIT));
}

void hal_carrier_start(uint8_t side, uint8_t half_period) {
  if (side == LEFT) {
    GPIOR0 = (uint8_t)(GPIOR0 | _BV(CARRIER_LEFT));
  } else {
    GPIOR0 = (uint8_t)(GPIOR0 | _BV(CARRIER_RIGHT));
  }
  OCR2A = (uint8_t)(half_period - 1u);
  TCNT2 = 0;
  TIFR2 = _BV(OCF2A);
  TIMSK2 = _BV(OCIE2A);
  TCCR2B = _BV(CS20);
}

void hal_carrier_stop(void) {
  TCCR2B = 0;
  TIMSK2 = 0;
  GPIOR0 = (uint8_t)(GPIOR0 & (uint8_t)~_BV(CARRIER_LEFT));
  GPIOR0 = (uint8_t)(GPIOR0 & (uint8_t)~_BV(CARRIER_RIGHT));
  HAL_PIN_LOW(INFRARED_LEFT_LED);
  HAL_PIN_LOW(INFRARED_RIGHT_LED);
}

/* ---- buzzer ---- */

/* 13 cycles with entry, vector and return; neither flags nor registers change. Compare B is somebody else's (hal_avr.h), and in this
 * mode it may be anything. */
HAL_ISR(TIMER0_COMPA_vect) {
  __asm__ volatile(
      "sbi %[pin], %[bit] \n"
      "reti               \n"
      :
      : [pin] "I"(_SFR_IO_ADDR(BUZZER_PINR)), [bit] "I"(BUZZER_BIT));
}

_Static_assert(HAL_TONE_BY_8 == _BV(CS01) && HAL_TONE_BY_1024 == (_BV(CS02) | _BV(CS00)), "clocks as in table 15-9");

void hal_tone_start(uint8_t clock, uint8_t count) {
  TCCR0A = _BV(WGM01);
  OCR0A = (uint8_t)(count - 1u);
  TCNT0 = 0;
  TIFR0 = _BV(OCF0A);
  TIMSK0 = _BV(OCIE0A);
  TCCR0B = clock;
}

void hal_tone_stop(void) {
  TCCR0B = 0;
  TIMSK0 = 0;
  HAL_PIN_LOW(BUZZER);
}

/* ---- Ping ---- */

/* The pulse may be longer by the interrupts in it; the sensor answers 750 us after its end. */
void hal_ping_trigger(void) {
  HAL_ATOMIC { hal_capture_stop(); }
  HAL_PIN_LOW(PING);
  HAL_PIN_OUTPUT(PING);
  HAL_PIN_HIGH(PING);
  __builtin_avr_delay_cycles(PING_TRIGGER_CYCLES - 2u);
  HAL_PIN_LOW(PING);
  HAL_PIN_MAKE_INPUT(PING);
  TCCR1B = _BV(ICES1) | _BV(CS10);
  TIFR1 = _BV(ICF1);
  HAL_ATOMIC { TIMSK1 = (uint8_t)(TIMSK1 | _BV(ICIE1)); }
}

/* ---- image ---- */

extern const uint8_t __data_load_end[]; /* by the linker: the first byte of flash after the image */

uint32_t hal_image_size(void) { return (uint16_t)(uintptr_t)__data_load_end; }

/* CRC-32 as of zlib, bit by bit: a table would take 64 bytes more, and no less time in an 8-bit CPU. */
uint32_t hal_image_hash(void) {
  uint32_t crc = 0xFFFFFFFFul;
  const uint16_t size = (uint16_t)hal_image_size();
  BOUNDED(FLASHEND + 1ul, for (uint16_t address = 0; address < size; address++)) {
    crc ^= pgm_read_byte(address);
    BOUNDED(8, for (uint8_t bit = 0; bit < 8u; bit++)) {
      const bool carry = ((uint8_t)crc & 1u) != 0;
      crc >>= 1;
      if (carry) {
        crc ^= 0xEDB88320ul;
      }
    }
  }
  return ~crc;
}
