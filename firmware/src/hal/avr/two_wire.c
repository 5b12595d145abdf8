/* two_wire.c: the two-wire bus as master (data sheet, 22). The bus waits while the flag TWINT is set; each command clears it. */
#include "hal/hal.h"

#define RATE ((F_CPU / 100000u - 16u) / 2u)

void hal_two_wire_on(void) {
  TWSR = 0;
  TWBR = RATE;
  TWCR = _BV(TWEN);
}

void hal_two_wire_off(void) { TWCR = 0; }

static void command(uint8_t bits) { TWCR = (uint8_t)(_BV(TWINT) | _BV(TWEN) | bits); }

void hal_two_wire_begin(void) { command(_BV(TWSTA) | _BV(TWIE)); }

void hal_two_wire_send(uint8_t byte) {
  TWDR = byte;
  command(_BV(TWIE));
}

void hal_two_wire_receive(bool more) { command(more ? (uint8_t)(_BV(TWIE) | _BV(TWEA)) : (uint8_t)_BV(TWIE)); }

void hal_two_wire_end(void) { command(_BV(TWSTO)); }

uint8_t hal_two_wire_status(void) { return TWSR & 0xF8u; }

uint8_t hal_two_wire_byte(void) { return TWDR; }
