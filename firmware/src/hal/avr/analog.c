/* analog.c: the converter, against the supply (data sheet, 24.4 and 24.9). */
#include "hal/hal.h"

#define CLOCK_BY_128 (_BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0)) /* 125 kHz: 50 to 200 are wanted for ten bits */

void hal_analog_select(uint8_t channel) { ADMUX = (uint8_t)(_BV(REFS0) | channel); }

void hal_analog_convert(void) { ADCSRA = _BV(ADEN) | _BV(ADSC) | CLOCK_BY_128; }

bool hal_analog_busy(void) { return (ADCSRA & _BV(ADSC)) != 0; }

uint16_t hal_analog_result(void) { return ADC; }
