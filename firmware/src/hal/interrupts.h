/* interrupts.h: who owns which interrupt. The board calls these functions, with interrupts off; each is short, stamps and
 * stores, and lets no other interrupt in. hal/avr/interrupts.c has the vectors, hal/native/chip.c calls them from its
 * queue of events. The interrupts that are not here (receive, send, IR
 * carrier, tone) belong to the board. */
#ifndef HAL_INTERRUPTS_H
#define HAL_INTERRUPTS_H

#include <stdint.h>

void schedule_on_slot(void);            /* a slot begins */
void servo_on_edge(void);               /* the edge of hal_edge_arm() is near */
void ping_on_edge(uint16_t time);       /* the captured edge of the Ping pin */
void light_on_left_fall(uint16_t time); /* or of a left light sensor on that pin, on maps without Ping */
void pin_changes_on_change(uint16_t time, uint8_t port_bits); /* a watched pin of port C has changed */
void port_d_on_change(uint16_t time);                         /* a watched pin of port D has changed */
void two_wire_on_step(void);                                  /* the two-wire bus has done a step */
void reset_on_watchdog(void);                                 /* the watchdog was not kicked: a reset follows */

#endif
