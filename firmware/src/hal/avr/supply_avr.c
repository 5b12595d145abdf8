/* supply_avr.c: the ATmega328P's converter measures its own bandgap against the supply (data sheet, 24.4 and 24.9). The
 * channel is never changed, so between two measurements the bandgap has a tick to settle. */
#include "hal/hal.h"

#define BANDGAP_CHANNEL 0x0Eu
#define CLOCK_BY_128 (_BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0)) /* 125 kHz: 50 to 200 are wanted for ten bits */

void hal_supply_sample(void) {
  ADMUX = _BV(REFS0) | BANDGAP_CHANNEL;
  ADCSRA = _BV(ADEN) | _BV(ADSC) | CLOCK_BY_128;
}

uint16_t hal_supply_result(void) { return ADC; }
