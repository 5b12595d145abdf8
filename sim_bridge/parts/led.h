/* led.h: a light-emitting diode with its resistor between a pin and ground, or 5 V and the pin.
 *
 * The current through both is (u - forward voltage) / resistance while a switched transistor of the pin is in the circuit;
 * the pin's own pull-up, some 35 kOhm (data sheet of the ATmega328P, table 28-1: 20 to 50), lets it glow. The brightness goes
 * with the current; 1 is that of a nominal one behind 220 Ohm at 5 V.
 */
#ifndef PART_LED_H
#define PART_LED_H

#include "part.h"

/* python: begin */
typedef struct {
  double forward_v;  /* across the diode */
  double ohm;        /* its resistor */
  double brightness; /* of this one, of a nominal one's */
  int to_supply;     /* 1: it is lit while the pin is low; 0: while it is high */
} led_parameters;

/* Shows its mean brightness since it was last asked. Parameters: led_parameters. Pin: the one that it is lit by. */
extern const part_kind led_kind;
/* python: end */

#endif
