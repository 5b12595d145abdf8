/* eeprom_avr.c: the EEPROM of the ATmega328P (data sheet, 8.6). */
#include "hal/hal.h"

/* The interrupt stands for a state, ready: it is switched off before others are let in, and only then does the body begin
 * (HAL_INTERRUPT_EEPROM), so that exact edges wait 13 cycles and no more. */
ISR(EE_READY_vect, ISR_NAKED) {
  __asm__ volatile(
      "cbi %[control], %[enable]   \n"
      "jmp __vector_eeprom_body    \n"
      :
      : [control] "I"(_SFR_IO_ADDR(EECR)), [enable] "I"(EERIE));
}

bool hal_eeprom_busy(void) { return (EECR & _BV(EEPE)) != 0; }

void hal_eeprom_wait(void) {
  while (hal_eeprom_busy()) {
  }
}

uint8_t hal_eeprom_read(uint16_t address) {
  EEAR = address;
  EECR |= _BV(EERE);
  return EEDR;
}

/* EEPE must follow EEMPE within four cycles: two single instructions with nothing in between. */
void hal_eeprom_write_start(uint16_t address, uint8_t value) {
  if (hal_eeprom_busy()) {
    return;
  }
  EEAR = address;
  EEDR = value;
  HAL_ATOMIC {
    EECR |= _BV(EEMPE);
    EECR |= _BV(EEPE);
  }
}

void hal_eeprom_interrupt(bool on) {
  if (on) {
    EECR |= _BV(EERIE);
  } else {
    EECR = (uint8_t)(EECR & (uint8_t)~_BV(EERIE));
  }
}
