/* motor_regulated.h: the velocity-regulated motor of the notes, (3.15), which a continuous-rotation servo is.
 *
 * Torque K (v_ref - v), limited. With two of them on a body, Euler steps are stable for dt < 2 M / (2 A K + alpha)
 * straight on and dt < 2 I / (2 B K R + beta) on the spot; the body does not check it, a vehicle's model does. Driven by
 * motor signals, v_ref is s times the speed at signal 1; a servo has its curve of pulses instead.
 */
#ifndef WORLD_MOTOR_REGULATED_H
#define WORLD_MOTOR_REGULATED_H

/* python: begin */
typedef struct {
  double gain_n_s;           /* K of (3.15): torque per speed error at the rim, N m / (m/s) */
  double torque_maximum_n_m; /* at nominal supply */
  double coast_n_s;          /* drag of the unpowered gear train, N m / (m/s) */
  double coast_maximum_n_m;  /* and where that drag saturates (dry friction) */
  double speed_maximum_m_s;  /* v_ref at motor signal 1; a servo does not use it */
} motor_regulated_parameters;

/* (3.15) with saturation: torque on the wheel, N m, for the reference and the actual speed at the rim, m/s. `supply`:
 * share of the nominal voltage. */
double motor_regulated(const motor_regulated_parameters *self, double reference, double speed, double supply);

/* v_ref, m/s, of a motor signal: s in [-1, 1], beyond it limited, times the speed at signal 1. */
double motor_regulated_reference(const motor_regulated_parameters *self, double signal);

/* Torque of the free-wheeling motor. */
double motor_coasting(const motor_regulated_parameters *self, double speed);
/* python: end */

#endif
