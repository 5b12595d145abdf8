/* servo_motor.h: a servo modified for continuous rotation (Parallax #900-00008), from its pulses to its torque.
 *
 * Its potentiometer is fixed, so that the width of a pulse sets a speed: by a curve measured on real units (tanh, a little
 * different both ways, with a dead band and a centre offset), reached with a lag by the regulated motor (3.15). The pulse
 * is sampled once per pulse. Without pulses it free-wheels after 50 ms. Speed and torque scale with the supply. Knows no
 * pin: pulses come as widths, or from a motor signal in [-1, 1] by the notes' map 1500 us +- 200 us.
 */
#ifndef WORLD_SERVO_MOTOR_H
#define WORLD_SERVO_MOTOR_H

#include "motor_regulated.h"

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
  motor_regulated_parameters motor;
} servo_motor_parameters;

typedef struct {
  double pulse_us;  /* the last one */
  double age_s;     /* since it; negative: there was none */
  double target;    /* m/s at the rim at nominal supply, by the curve */
  double reference; /* m/s, lagging behind it */
  double dt;        /* of the world step, s */
  double lag_share; /* of the way to the target made in one step */
} servo_motor;

/* Steady speed of the rim, m/s forward, for a pulse of that width at nominal supply. */
double servo_motor_curve(const servo_motor_parameters *p, double pulse_us);

/* The pulse of a motor signal: +1 full forward, -1 full backward, beyond it limited. */
double servo_motor_pulse_of(const servo_motor_parameters *p, double signal);

/* A unit that has seen no pulse, in a world of steps of `dt` seconds. */
void servo_motor_init(const servo_motor_parameters *p, servo_motor *self, double dt);

/* A pulse ends now. Returns 1, or 0 for a width that no servo takes (outside 500 to 2500 us). */
int servo_motor_pulse(const servo_motor_parameters *p, servo_motor *self, double pulse_us);

/* Torque on the wheel, N m, for the next step, while the rim moves at `speed` m/s. `supply`: share of the nominal
 * voltage. */
double servo_motor_torque(const servo_motor_parameters *p, servo_motor *self, double speed, double supply);
/* python: end */

#define SERVO_MOTOR_NEUTRAL_US 1500.0
#define SERVO_MOTOR_SPAN_US 200.0
#define SERVO_MOTOR_HOLD_S 0.050 /* without a pulse for this long: it lets go */

#endif
