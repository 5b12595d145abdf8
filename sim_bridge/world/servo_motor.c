/* servo_motor.c: see servo_motor.h. */
#include "servo_motor.h"

#include "geometry/numbers.h"

#define PULSE_MINIMUM_US 500.0
#define PULSE_MAXIMUM_US 2500.0

double servo_motor_curve(const servo_motor_parameters *p, double pulse_us) {
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

double servo_motor_pulse_of(const servo_motor_parameters *p, double signal) {
  const double s = signal > 1.0 ? 1.0 : (signal < -1.0 ? -1.0 : signal);
  return SERVO_MOTOR_NEUTRAL_US + p->mount * SERVO_MOTOR_SPAN_US * s;
}

void servo_motor_init(const servo_motor_parameters *p, servo_motor *self, double dt) {
  *self = (servo_motor){
      .age_s = -1.0,
      .dt = dt,
      .lag_share = p->lag_s > 0.0 ? 1.0 - number_exp(-dt / p->lag_s) : 1.0,
  };
}

int servo_motor_pulse(const servo_motor_parameters *p, servo_motor *self, double pulse_us) {
  if (!(pulse_us >= PULSE_MINIMUM_US && pulse_us <= PULSE_MAXIMUM_US)) return 0;
  if (pulse_us != self->pulse_us) self->target = servo_motor_curve(p, pulse_us); /* the curve costs a tanh */
  self->pulse_us = pulse_us;
  self->age_s = 0.0;
  return 1;
}

double servo_motor_torque(const servo_motor_parameters *p, servo_motor *self, double speed, double supply) {
  if (!(self->age_s >= 0.0 && self->age_s <= SERVO_MOTOR_HOLD_S)) {
    self->reference = speed;
    return motor_coasting(&p->motor, speed);
  }
  self->age_s += self->dt;
  self->reference += self->lag_share * (self->target * supply - self->reference);
  return motor_regulated(&p->motor, self->reference, speed, supply); /* (3.15) */
}
