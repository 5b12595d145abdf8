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

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  servo *self = (servo *)base;
  (void)pin;
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

/* The torque of the coming step, by the wheel's speed and the supply as it begins. */
static void before_step(part *base) {
  servo *self = (servo *)base;
  const chassis *c = base->chassis;
  chassis_wheel *wheel = &base->chassis->wheel[self->side];
  const motor_parameters *motor = &self->parameters.motor;
  wheel->powered = self->pulses > 0;
  if (self->pulses == 0 || c->since > self->last_pulse + HOLD_CYCLES) {
    self->reference = wheel->speed;
    wheel->torque = motor_coasting(motor, wheel->speed);
    return;
  }
  self->reference += self->lag_share * (self->target * c->supply - self->reference);
  wheel->torque = motor_regulated(motor, self->reference, wheel->speed, c->supply);
}

static const part_operations OPERATIONS = {.edge = edge, .before_step = before_step};

void servo_init(servo *self, const part_place *place, uint8_t pin, int side, const servo_parameters *parameters,
                double dt) {
  memset(self, 0, sizeof *self);
  part_join(&self->part, &OPERATIONS, place, &(part_pin){pin, PART_HEARS}, 1);
  self->side = side;
  self->parameters = *parameters;
  self->lag_share = parameters->lag_s > 0.0 ? 1.0 - number_exp(-dt / parameters->lag_s) : 1.0;
}
