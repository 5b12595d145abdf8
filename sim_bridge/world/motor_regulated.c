/* motor_regulated.c: see motor_regulated.h. */
#include "motor_regulated.h"

static double limited(double value, double maximum) {
  if (value > maximum) return maximum;
  if (value < -maximum) return -maximum;
  return value;
}

double motor_regulated(const motor_regulated_parameters *self, double reference, double speed, double supply) {
  return limited(self->gain_n_s * (reference - speed), self->torque_maximum_n_m * supply); /* (3.15) */
}

double motor_regulated_reference(const motor_regulated_parameters *self, double signal) {
  return limited(signal, 1.0) * self->speed_maximum_m_s;
}

double motor_coasting(const motor_regulated_parameters *self, double speed) {
  return limited(-self->coast_n_s * speed, self->coast_maximum_n_m);
}
