/* motor_dc.h: a direct-current motor with an ideal gear, section 1.2 of the notes, (1.1)-(1.10).
 *
 * Quasi-static: the current follows the voltage at once, (1.8). Full: (1.1) with its inductance, solved exactly over a
 * step in which voltage and speed hold still (an exponential), so that any step is stable. Friction is Coulomb and
 * viscous, (1.9); at rest the motor holds until the generated torque overcomes Coulomb friction. The gear multiplies
 * torque and divides speed, (1.10); the torque at the shaft is limited.
 *
 * Under explicit Euler steps the Coulomb term would throw a coasting wheel to and fro across standstill. `hold` prevents
 * it: the torque per rad/s that stops the wheel within a step (inertia felt at the wheel / dt, see body_wheel_hold);
 * friction then stops the wheel at most. 0: (1.9) as it stands.
 */
#ifndef WORLD_MOTOR_DC_H
#define WORLD_MOTOR_DC_H

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

/* The default motor of the notes' simulator: 12 V, c_t = c_e = 0.0333, R 0.62 ohm, c_C 0.008 N m, c_v 0.02 N m s, G 2,
 * 1 N m, and L 0.2 mH. */
void motor_dc_default(motor_dc_parameters *out);

/* Volts for a motor signal: s in [-1, 1], beyond it limited, times the maximum. */
double motor_dc_voltage(const motor_dc_parameters *self, double signal);

/* Quasi-static current, A, at `volts` while the shaft turns at `speed` rad/s. */
double motor_dc_current(const motor_dc_parameters *self, double volts, double speed);

/* Torque at the shaft, N m, for a current in A: friction, gear, limit. */
double motor_dc_shaft_torque(const motor_dc_parameters *self, double current, double speed, double hold);

/* Quasi-static torque at the shaft, N m: (1.8), (1.9), (1.10). */
double motor_dc_torque(const motor_dc_parameters *self, double volts, double speed, double hold);

/* The same of the full model for the next `dt` seconds: `current`, A, goes from its value at their beginning to that at
 * their end by (1.1); the torque is that of its mean. Without inductance it is the quasi-static motor. */
double motor_dc_step(const motor_dc_parameters *self, double *current, double volts, double speed, double hold,
                     double dt);
/* python: end */

#endif
