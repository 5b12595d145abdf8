/* servo.h: the pin of a continuous-rotation servo: it measures the width of each pulse, which the motor behind it takes.
 *
 * A pulse counts at its falling edge. What the servo then does is world/servo_motor; a wheel is on its shaft.
 * Faults: dead, it hears no pulse; reversed, pulses mirrored about the one at which it stands; offset, pulses longer by us;
 * weak, that share of its torque.
 */
#ifndef PART_SERVO_H
#define PART_SERVO_H

#include "../world/servo_motor.h"
#include "part.h"

typedef struct {
  part part;
  int side; /* 0 left, 1 right */
  servo_motor_parameters parameters;
  servo_motor motor;
  part_pulse pulse;
  uint32_t pulses; /* since power-on */
} servo;

/* python: begin */
/* Turns a wheel; parameters: servo_motor_parameters. Pin: the signal. */
extern const part_kind servo_kind;
/* python: end */

#endif
