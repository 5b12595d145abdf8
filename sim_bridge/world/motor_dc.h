/* motor_dc.h: a direct-current motor with an ideal gear, section 1.2 of the notes, (1.1)-(1.10).
 *
 * Quasi-static: the current follows the voltage at once, (1.8). Full: the current is a state, (1.1) with its inductance,
 * solved exactly over a step in which voltage and speed hold still (an exponential); the torque is that of the mean
 * current. Friction is Coulomb and viscous, (1.9); at rest the motor holds until the generated torque overcomes Coulomb
 * friction. The gear multiplies torque and divides speed, (1.10); the torque at the shaft is limited.
 *
 * Why not sub-steps: L / R is 0.3 ms, explicit ones would be thirty in a step of 10 ms, and more for a smaller L. The
 * exponential takes any L, and asks of the step no more than the quasi-static motor does. Let q = dt * rate by the
 * back-EMF and d = dt * rate by friction and drag, with q + d < 2 (Euler's limit of the quasi-static motor), h = R dt / L,
 * E = exp(-h), f = (1 - E) / h. A step takes (i, v) by [[E, E - 1], [q f, 1 - d - q (1 - f)]] (i in units that make its
 * settled value -v). Its trace T and determinant D satisfy 1 - T + D = (1 - E)(q + d) > 0 and
 * 1 + T + D = (1 + E)(2 - d - q (1 - f)) + q f (1 - E) > 0; D < 1 is q (f - E) < 1 - E (1 - d), which for q < 2 - d
 * follows from 2 f < 1 + E, that is tanh(h / 2) < h / 2. So both eigenvalues lie within the unit circle for every L.
 *
 * Under explicit Euler steps the Coulomb term would throw a coasting wheel to and fro across standstill. `hold` prevents
 * it: the torque per rad/s that stops the wheel within a step (inertia felt at the wheel / dt, see body_wheel_hold);
 * friction then stops the wheel at most. 0: (1.9) as it stands.
 */
#ifndef WORLD_MOTOR_DC_H
#define WORLD_MOTOR_DC_H

#include <math.h>

#include "geometry/numbers.h"

#define MOTOR_DC_STANDSTILL 1e-6 /* rad/s of the motor's axis */

/* python: begin */
typedef struct {
  double torque_constant;    /* c_t, N m / A */
  double emf_constant;       /* c_e, V s/rad */
  double resistance_ohm;     /* of the armature */
  double inductance_h;       /* of the armature; for motor_dc_step only */
  double coulomb_n_m;        /* c_C, at the motor's axis */
  double viscous_n_m_s;      /* c_v, N m / (rad/s) */
  double gear;               /* G: turns of the motor per turn of the shaft */
  double efficiency;         /* of the gear */
  double torque_maximum_n_m; /* at the shaft */
  double voltage_maximum;    /* volts at motor signal 1 */
} motor_dc_parameters;

/* Volts for a motor signal: s in [-1, 1], beyond it limited, times the maximum. */
static double motor_dc_voltage(const motor_dc_parameters *self, double signal);

/* Quasi-static current, A, at `volts` while the shaft turns at `speed` rad/s. */
static double motor_dc_current(const motor_dc_parameters *self, double volts, double speed);

/* Torque at the shaft, N m, for a current in A: friction, gear, limit. */
static double motor_dc_shaft_torque(const motor_dc_parameters *self, double current, double speed, double hold);

/* Quasi-static torque at the shaft, N m: (1.8), (1.9), (1.10). */
static double motor_dc_torque(const motor_dc_parameters *self, double volts, double speed, double hold);

/* The same of the full model for the next `dt` seconds: `current`, A, goes from its value at their beginning to that at
 * their end by (1.1); the torque is that of its mean. Without inductance it is the quasi-static motor. */
double motor_dc_step(const motor_dc_parameters *self, double *current, double volts, double speed, double hold,
                     double dt);
/* python: end */

NUMBERS_INLINE double motor_dc_voltage(const motor_dc_parameters *self, double signal) {
  return number_limited(signal, 1.0) * self->voltage_maximum;
}

NUMBERS_INLINE double motor_dc_current(const motor_dc_parameters *self, double volts, double speed) {
  return (volts - self->emf_constant * self->gear * speed) / self->resistance_ohm; /* (1.1) with di/dt = 0, (1.2) */
}

/* Torque per rad/s of the motor's axis with which friction stops it, `hold` being that of the wheel; without one any
 * motion meets the whole friction. */
NUMBERS_INLINE double motor_dc_stopping(const motor_dc_parameters *self, double hold) {
  const double ratio = self->gear * self->efficiency;
  const double axis_hold = ratio > 0.0 ? hold / (ratio * self->gear) : 0.0;
  return axis_hold > 0.0 ? axis_hold : 1e300;
}

/* Coulomb friction at the motor's axis against `driving` torque: it holds a motor that stands, and stops one that moves
 * at most. */
NUMBERS_INLINE double motor_dc_coulomb(const motor_dc_parameters *self, double driving, double axis, double stopping) {
  const double opposed = fabs(axis) < MOTOR_DC_STANDSTILL ? driving : driving + stopping * axis;
  return number_limited(opposed, self->coulomb_n_m);
}

/* motor_dc_shaft_torque with what motor_dc_stopping says. */
NUMBERS_INLINE double motor_dc_geared(const motor_dc_parameters *self, double current, double speed, double stopping) {
  const double axis = self->gear * speed;                        /* (1.10) */
  const double generated = self->torque_constant * current;      /* (1.3) */
  const double driving = generated - self->viscous_n_m_s * axis; /* (1.9) */
  const double torque = driving - motor_dc_coulomb(self, driving, axis, stopping);
  return number_limited(self->gear * self->efficiency * torque, self->torque_maximum_n_m); /* (1.10) */
}

NUMBERS_INLINE double motor_dc_shaft_torque(const motor_dc_parameters *self, double current, double speed,
                                            double hold) {
  return motor_dc_geared(self, current, speed, motor_dc_stopping(self, hold));
}

NUMBERS_INLINE double motor_dc_torque(const motor_dc_parameters *self, double volts, double speed, double hold) {
  return motor_dc_shaft_torque(self, motor_dc_current(self, volts, speed), speed, hold); /* (1.8), (1.9) */
}

#endif
