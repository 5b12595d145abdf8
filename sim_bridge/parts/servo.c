/* servo.c: see servo.h. */
#include "servo.h"

#include <string.h>

#include "../world/numbers.h"

#define PULSE_MINIMUM_US 500.0
#define PULSE_MAXIMUM_US 2500.0
#define HOLD_CYCLES (BOARD_CLOCK_HZ / 20u) /* 50 ms without a pulse: the servo lets go */

double servo_curve(const servo_parameters *p, double pulse_us) {
  const double offset = pulse_us - p->centre_us;
  double turn;
  if (offset > p->dead_band_us) {
    turn = p->top_ccw_rad_s * number_tanh(offset / p->scale_ccw_us);
  } else if (offset < -p->dead_band_us) {
    turn = p->top_cw_rad_s * number_tanh(offset / p->scale_cw_us);
  } else {
    turn = 0.0;
  }
  return p->mount * turn * p->wheel_radius;
}

void servo_init(servo *self, const part_place *place, uint8_t pin, const servo_parameters *parameters, double dt) {
  memset(self, 0, sizeof *self);
  self->place = *place;
  self->pin = pin;
  self->parameters = *parameters;
  self->lag_share = parameters->lag_s > 0.0 ? 1.0 - number_exp(-dt / parameters->lag_s) : 1.0;
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
  if (width < PULSE_MINIMUM_US || width > PULSE_MAXIMUM_US) return;
  self->last_pulse = cycle;
  self->pulses++;
  if (width == self->pulse_us) return;
  self->pulse_us = width;
  self->target = servo_curve(&self->parameters, width);
}

double servo_torque(servo *self, uint64_t cycle, double wheel_speed, double supply) {
  if (self->pulses == 0 || cycle > self->last_pulse + HOLD_CYCLES) {
    self->reference = wheel_speed;
    return motor_coasting(&self->parameters.motor, wheel_speed);
  }
  self->reference += self->lag_share * (self->target * supply - self->reference);
  return motor_regulated(&self->parameters.motor, self->reference, wheel_speed, supply);
}
