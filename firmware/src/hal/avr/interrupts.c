/* interrupts.c: the vectors of the interrupts that the firmware owns (hal/interrupts.h). The others stand with their unit: the
 * UART's in serial.c, the carrier's in carrier.c, the tone's in tone.c.
 *
 * Link-time optimisation puts each handler in line here. Those that may come in the midst of a burst of bytes look for one
 * before they end. */
#include "hal/interrupts.h"

#include "hal/hal.h"

/* The table of tasks.def has the vectors' numbers for the analysis of the timing. */
#define IS_VECTOR(name, vector) _Static_assert(VECTOR_##name == vector##_num, "tasks.def: vector of " #name)
enum {
#define INTERRUPT(name, vector, budget, latency, interval) VECTOR_##name = (vector),
#include "tasks.def"
};
IS_VECTOR(changes, PCINT1_vect);
IS_VECTOR(port_d, PCINT2_vect);
IS_VECTOR(watchdog, WDT_vect);
IS_VECTOR(carrier, TIMER2_COMPA_vect);
IS_VECTOR(capture, TIMER1_CAPT_vect);
IS_VECTOR(edge, TIMER1_COMPA_vect);
IS_VECTOR(slot, TIMER1_COMPB_vect);
IS_VECTOR(tone, TIMER0_COMPA_vect);
IS_VECTOR(receive, USART_RX_vect);
IS_VECTOR(send, USART_UDRE_vect);
IS_VECTOR(two_wire, TWI_vect);

ISR(PCINT1_vect) {
  const uint16_t time = TCNT1;
  pin_changes_on_change(time, PINC);
  hal_serial_take_waiting();
}

ISR(PCINT2_vect) { port_d_on_change(TCNT1); }

ISR(WDT_vect) { reset_on_watchdog(); }

ISR(TIMER1_CAPT_vect) {
#ifdef LIGHT_LEFT_IS_CAPTURED
  light_on_left_fall(ICR1);
#else
  ping_on_edge(ICR1);
#endif
  hal_serial_take_waiting();
}

ISR(TIMER1_COMPA_vect) {
  servo_on_edge();
  hal_serial_take_waiting();
}

ISR(TIMER1_COMPB_vect) {
  schedule_on_slot();
  hal_serial_take_waiting();
}

ISR(TWI_vect) { two_wire_on_step(); }
