/* servo.h: the pin of a continuous-rotation servo: it measures the width of each pulse, which the motor behind it takes.
 *
 * A pulse is taken at its falling edge. What the servo then does is world/servo_motor.
 */
#ifndef PART_SERVO_H
#define PART_SERVO_H

#include "../world/servo_motor.h"
#include "part.h"

typedef struct {
  part_place place;
  uint8_t pin;
  servo_motor_parameters parameters;
  servo_motor motor;
  uint8_t high;
  uint64_t rise;
  uint32_t pulses; /* since power-on */
} servo;

void servo_init(servo *self, const part_place *place, uint8_t pin, const servo_motor_parameters *parameters, double dt);

/* The board does `level` to the pin from `cycle` on. */
void servo_edge(servo *self, uint64_t cycle, uint8_t level);

/* Torque on the wheel for the next world step. `supply`: share of the nominal voltage. */
double servo_torque(servo *self, double wheel_speed, double supply);

#endif
