/* motor.h: what turns a wheel. Here the velocity-regulated motor of (3.15), which a continuous-rotation servo is. */
#ifndef WORLD_MOTOR_H
#define WORLD_MOTOR_H

/* python: begin */
typedef struct {
  double gain_n_s;           /* K of (3.15): torque per speed error at the rim, N m / (m/s) */
  double torque_maximum_n_m; /* at nominal supply */
  double coast_n_s;          /* drag of the unpowered gear train, N m / (m/s) */
  double coast_maximum_n_m;  /* and where that drag saturates (dry friction) */
} motor_parameters;

/* (3.15) with saturation: torque on the wheel, N m, for the reference and the actual speed at the rim, m/s. */
double motor_regulated(const motor_parameters *self, double reference, double speed, double supply);

/* Torque of the free-wheeling motor. */
double motor_coasting(const motor_parameters *self, double speed);
/* python: end */

#endif
