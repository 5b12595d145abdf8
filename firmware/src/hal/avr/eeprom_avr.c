/* eeprom_avr.c: the EEPROM's ready interrupt; the rest is in hal_avr.h. */
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
