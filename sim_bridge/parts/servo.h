/* servo.h: a servo modified for continuous rotation (Parallax #900-00008), one wheel on its shaft.
 *
 * It measures each pulse on its pin and turns at the speed that its curve gives for that width (curves measured on real
 * units: tanh, a little different both ways, with a dead band and a centre offset); it reaches that speed with a lag. Without
 * pulses it free-wheels. A pulse is taken at its falling edge. Speeds scale with the supply.
 */
#ifndef PART_SERVO_H
#define PART_SERVO_H

#include "../world/motor.h"
#include "part.h"

/* python: begin */
typedef struct {
  double mount;         /* +1: counter-clockwise drives the robot forward (left), -1: clockwise does (right) */
  double wheel_radius;  /* m */
  double centre_us;     /* the pulse at which this unit stands still */
  double dead_band_us;  /* it also stands still this near to it */
  double top_ccw_rad_s; /* speed = top * tanh(offset / scale), counter-clockwise */
  double scale_ccw_us;
  double top_cw_rad_s; /* and clockwise */
  double scale_cw_us;
  double lag_s; /* time constant of the speed */
  motor_parameters motor;
} servo_parameters;

/* Steady speed of the rim, m/s forward, for a pulse of that width at nominal supply. */
double servo_curve(const servo_parameters *p, double pulse_us);
/* python: end */

typedef struct {
  part part;
  int side; /* 0 left, 1 right */
  servo_parameters parameters;
  double lag_share; /* of the way to the target made in one world step */
  uint8_t high;
  uint64_t rise;
  uint64_t last_pulse;
  uint32_t pulses;  /* since power-on */
  double pulse_us;  /* the last one */
  double target;    /* m/s, by the curve */
  double reference; /* m/s, lagging behind it */
} servo;

/* A servo that turns the wheel of `side` (0 left, 1 right); `dt`: the world's step, s. */
void servo_init(servo *self, const part_place *place, uint8_t pin, int side, const servo_parameters *parameters,
                double dt);

#endif
