/* motor_dc.c: see motor_dc.h. */
#include "motor_dc.h"

#include "geometry/numbers.h"

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
