/* servo.c: see servo.h. */
#include "servo.h"

#include <string.h>

void servo_init(servo *self, const part_place *place, uint8_t pin, const servo_motor_parameters *parameters,
                double dt) {
  memset(self, 0, sizeof *self);
  self->place = *place;
  self->pin = pin;
  self->parameters = *parameters;
  servo_motor_init(parameters, &self->motor, dt);
}

void servo_edge(servo *self, uint64_t cycle, uint8_t level) {
  const uint8_t high = level == BOARD_HIGH;
  if (high == self->high) return;
  self->high = high;
  if (high) {
    self->rise = cycle;
    return;
  }
  const double width = (double)(cycle - self->rise) * (1e6 / BOARD_CLOCK_HZ);
  if (servo_motor_pulse(&self->parameters, &self->motor, width)) self->pulses++;
}

double servo_torque(servo *self, double wheel_speed, double supply) {
  return servo_motor_torque(&self->parameters, &self->motor, wheel_speed, supply);
}
