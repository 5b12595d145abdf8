/* motor_position.c: see motor_position.h. */
#include "motor_position.h"

#include <math.h>

#include "geometry/numbers.h"

#define PULSE_MINIMUM_US 500.0
#define PULSE_MAXIMUM_US 2500.0
#define HOLD_S 0.050 /* without a pulse for this long: the controller rests */

void motor_position_default(motor_position_parameters *out) {
  *out = (motor_position_parameters){
      .mount = 1.0,
      .centre_us = 1500.0,
      .us_per_rad = 500.0 / (NUMBERS_PI / 4.0),
      .range_rad = NUMBERS_PI / 2.0,
      .gain_per_s = 20.0,
      .top_speed_rad_s = 5.0,
      .dead_band_us = 4.0,
  };
}

double motor_position_angle_of(const motor_position_parameters *p, double pulse_us) {
  const double angle = p->mount * (pulse_us - p->centre_us) / p->us_per_rad;
  return angle > p->range_rad ? p->range_rad : (angle < -p->range_rad ? -p->range_rad : angle);
}

double motor_position_pulse_of(const motor_position_parameters *p, double angle) {
  return p->centre_us + p->mount * angle * p->us_per_rad;
}

void motor_position_init(motor_position *self, double angle) {
  *self = (motor_position){.angle = angle, .target = angle, .age_s = -1.0};
}

int motor_position_pulse(const motor_position_parameters *p, motor_position *self, double pulse_us) {
  if (!(pulse_us >= PULSE_MINIMUM_US && pulse_us <= PULSE_MAXIMUM_US)) return 0;
  self->target = motor_position_angle_of(p, pulse_us);
  self->age_s = 0.0;
  return 1;
}

void motor_position_step(const motor_position_parameters *p, motor_position *self, double supply, double dt) {
  if (!(self->age_s >= 0.0 && self->age_s <= HOLD_S)) return;
  self->age_s += dt;
  const double error = self->target - self->angle;
  const double top = p->top_speed_rad_s * supply;
  double left = fabs(error);
  if (left <= p->dead_band_us / p->us_per_rad || !(top > 0.0)) return;
  const double corner = top / p->gain_per_s; /* nearer than this the rate is below its limit */
  double time = dt;
  if (left > corner) { /* straight line */
    const double until = (left - corner) / top;
    if (until >= time) {
      self->angle += (error > 0.0 ? top : -top) * time;
      return;
    }
    left = corner;
    time -= until;
  }
  left *= number_exp(-p->gain_per_s * time);
  self->angle = self->target - (error > 0.0 ? left : -left);
}
