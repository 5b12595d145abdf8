/* timers.c: Timer1, which is the board's time. */
#include "hal/hal.h"

#if F_CPU != 16000000UL
#error "the board runs at 16 MHz"
#endif

void hal_start_timers(void) {
  PCICR = _BV(PCIE1) | _BV(PCIE2);
  SMCR = _BV(SE); /* idle: timers and UART go on */
  TCCR1A = 0;
  TCCR1B = 0;
  TCNT1 = 0;
  hal_slot_arm(HAL_SLOT_CYCLES);
  TIFR1 = _BV(OCF1B);
  TIMSK1 = _BV(OCIE1B);
  TCCR1B = _BV(CS10);
  sei();
}
