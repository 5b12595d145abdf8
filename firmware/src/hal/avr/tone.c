/* tone.c: tones of the buzzer, by Timer0: its interrupt toggles the pin. */
#include "hal/hal.h"

_Static_assert(HAL_TONE_BY_8 == _BV(CS01) && HAL_TONE_BY_1024 == (_BV(CS02) | _BV(CS00)), "clocks as in table 15-9");

ISR(TIMER0_COMPA_vect) { HAL_PIN_TOGGLE(BUZZER); }

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
