/* stamp_avr.c: the pin-change interrupt of port D: it stamps one change and masks itself, 30 cycles with entry, vector and
 * return; no flags change. */
#include "hal/hal.h"
#include "schedule.h"

HAL_NAMED volatile uint8_t hal_stamp_slot;
HAL_NAMED volatile uint16_t hal_stamp_time;

ISR(PCINT2_vect, ISR_NAKED) {
  __asm__ volatile(
      "push r24                    \n"
      "lds r24, %[low]             \n" /* also latches the high byte */
      "sts hal_stamp_time, r24     \n"
      "lds r24, %[high]            \n"
      "sts hal_stamp_time+1, r24   \n"
      "lds r24, schedule_slot      \n"
      "sts hal_stamp_slot, r24     \n"
      "ldi r24, 0                  \n"
      "sts %[mask], r24            \n"
      "pop r24                     \n"
      "reti                        \n"
      :
      : [low] "n"(_SFR_MEM_ADDR(TCNT1L)), [high] "n"(_SFR_MEM_ADDR(TCNT1H)), [mask] "n"(_SFR_MEM_ADDR(PCMSK2)));
}
