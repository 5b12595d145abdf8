/* two_wire_avr.c: the entry of the two-wire bus's interrupt; the rest is in hal_avr.h. */
#include "hal/hal.h"

/* The bus waits while its flag is set. So the interrupt is switched off, the flag left as it is, before others are let in;
 * only then does the body begin (HAL_INTERRUPT_TWO_WIRE), and exact edges wait 19 cycles and no more,
 * or 26 at the body's end. All in all it takes some 105. No flags change. */
ISR(TWI_vect, ISR_NAKED) {
  __asm__ volatile(
      "push r24                     \n"
      "ldi r24, %[waiting]          \n"
      "sts %[control], r24          \n"
      "pop r24                      \n"
      "jmp __vector_two_wire_body   \n"
      :
      : [control] "n"(_SFR_MEM_ADDR(TWCR)), [waiting] "M"(_BV(TWEN)));
}
