/* motor_dc.c: see motor_dc.h. */
#include "motor_dc.h"

#include "geometry/numbers.h"

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
