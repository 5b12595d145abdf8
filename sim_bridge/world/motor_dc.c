/* motor_dc.c: see motor_dc.h. */
#include "motor_dc.h"

#include <math.h>

#include "numbers.h"

#define STANDSTILL 1e-6 /* rad/s of the motor's axis */

/* Each comparison is a single operation without a branch. */
static double limited(double value, double limit) {
  const double below = value < limit ? value : limit;
  return below > -limit ? below : -limit;
}

void motor_dc_default(motor_dc_parameters *out) {
  *out = (motor_dc_parameters){
      .torque_constant = 0.0333,
      .emf_constant = 0.0333,
      .resistance_ohm = 0.62,
      .inductance_h = 0.2e-3,
      .coulomb_n_m = 0.008,
      .viscous_n_m_s = 0.02,
      .gear = 2.0,
      .efficiency = 1.0,
      .torque_maximum_n_m = 1.0,
      .voltage_maximum = 12.0,
  };
}

double motor_dc_voltage(const motor_dc_parameters *self, double signal) {
  return limited(signal, 1.0) * self->voltage_maximum;
}

double motor_dc_current(const motor_dc_parameters *self, double volts, double speed) {
  return (volts - self->emf_constant * self->gear * speed) / self->resistance_ohm; /* (1.1) with di/dt = 0, (1.2) */
}

/* Coulomb friction at the motor's axis against `driving` torque: it holds a motor that stands, and stops one that moves
 * at most: `hold` is here the torque per rad/s of the axis that stops it within the step. */
static double coulomb(const motor_dc_parameters *self, double driving, double axis, double hold) {
  const double c = self->coulomb_n_m;
  if (fabs(axis) < STANDSTILL) return limited(driving, c);
  if (hold > 0.0) return limited(driving + hold * axis, c);
  return axis > 0.0 ? c : -c;
}

double motor_dc_shaft_torque(const motor_dc_parameters *self, double current, double speed, double hold) {
  const double axis = self->gear * speed;                        /* (1.10) */
  const double generated = self->torque_constant * current;      /* (1.3) */
  const double driving = generated - self->viscous_n_m_s * axis; /* (1.9) */
  const double ratio = self->gear * self->efficiency;
  const double axis_hold = ratio > 0.0 ? hold / (ratio * self->gear) : 0.0;
  const double torque = driving - coulomb(self, driving, axis, axis_hold);
  return limited(ratio * torque, self->torque_maximum_n_m); /* (1.10) */
}

double motor_dc_torque(const motor_dc_parameters *self, double volts, double speed, double hold) {
  return motor_dc_shaft_torque(self, motor_dc_current(self, volts, speed), speed, hold); /* (1.8), (1.9) */
}

double motor_dc_step(const motor_dc_parameters *self, double *current, double volts, double speed, double hold,
                     double dt) {
  const double settled = motor_dc_current(self, volts, speed);
  double mean = settled;
  if (self->inductance_h > 0.0) {
    const double steps = self->resistance_ohm * dt / self->inductance_h; /* dt in units of L / R */
    const double gone = 1.0 - number_exp(-steps);
    const double start = *current;
    mean = settled + (start - settled) * (steps > 1e-8 ? gone / steps : 1.0);
    *current = start + (settled - start) * gone;
  } else {
    *current = settled;
  }
  return motor_dc_shaft_torque(self, mean, speed, hold);
}
