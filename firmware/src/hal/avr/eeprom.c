/* eeprom.c: the EEPROM, cell by cell (data sheet, 8.6). */
#include "hal/hal.h"

/* 26,368 periods of the RC oscillator (table 8-1), whose 8 MHz may be 10 % less (table 29-1). */
#define WRITE_CYCLES (26368ul * (F_CPU / 100000ul) / 72ul)

bool hal_eeprom_busy(void) { return (EECR & _BV(EEPE)) != 0; }

void hal_eeprom_wait(void) {
  while (hal_eeprom_busy()) {
    LOOP_CYCLES(WRITE_CYCLES);
  }
}

uint8_t hal_eeprom_read(uint16_t address) {
  EEAR = address;
  EECR |= _BV(EERE);
  return EEDR;
}

/* EEPE must follow EEMPE within four cycles: two single instructions with nothing in between. */
void hal_eeprom_write_start(uint16_t address, uint8_t value) {
  EEAR = address;
  EEDR = value;
  HAL_ATOMIC {
    EECR |= _BV(EEMPE);
    EECR |= _BV(EEPE);
  }
}
