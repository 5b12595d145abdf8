/* stamp_avr.c: the pin-change interrupt of port D: it stamps one change and masks itself, 24 cycles with entry, vector and
 * return; no flags change. */
#include "hal/hal.h"
#include "schedule.h"

HAL_NAMED volatile uint8_t hal_stamp_slot;
HAL_NAMED volatile uint16_t hal_stamp_time;

HAL_ISR(PCINT2_vect) {
  __asm__ volatile(
      "lds r3,  %[low]             \n" /* also latches the high byte */
      "sts hal_stamp_time, r3      \n"
      "lds r3,  %[high]            \n"
      "sts hal_stamp_time+1, r3    \n"
      "lds r3,  schedule_slot      \n"
      "sts hal_stamp_slot, r3      \n"
      "sts %[mask], r2             \n"
      "reti                        \n"
      :
      : [low] "n"(_SFR_MEM_ADDR(TCNT1L)), [high] "n"(_SFR_MEM_ADDR(TCNT1H)), [mask] "n"(_SFR_MEM_ADDR(PCMSK2)));
}
