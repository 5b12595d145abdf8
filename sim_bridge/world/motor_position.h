/* motor_position.h: a position servo: motor, gear, potentiometer and controller; a turret sits on one (section 1.2.2).
 *
 * The width of a pulse encodes an angle, 1500 us straight ahead and 500 us more for 45 degrees to the left; the shaft
 * follows by d(alpha)/dt = K_s (alpha_ref - alpha), no faster than its top speed. The step is solved exactly: a straight
 * line while the rate is limited, then an exponential. Within the dead band the controller rests; without pulses the gear
 * holds. The top speed scales with the supply.
 */
#ifndef WORLD_MOTOR_POSITION_H
#define WORLD_MOTOR_POSITION_H

/* python: begin */
typedef struct {
  double mount;           /* +1: longer pulses turn counter-clockwise, -1: clockwise */
  double centre_us;       /* the pulse of angle 0, with this unit's offset */
  double us_per_rad;      /* 500 us for pi / 4 */
  double range_rad;       /* to either side: the stops */
  double gain_per_s;      /* K_s */
  double top_speed_rad_s; /* omega_s, at nominal supply */
  double dead_band_us;    /* it rests this near to its pulse's angle */
} motor_position_parameters;

typedef struct {
  double angle;  /* rad, counter-clockwise from straight ahead */
  double target; /* rad, by the last pulse */
  double age_s;  /* since it; negative: there was none */
} motor_position;

/* The notes' standard servo: 500 us for 45 degrees, +- 90 degrees, K_s 20 1/s, 5 rad/s, dead band 4 us. */
void motor_position_default(motor_position_parameters *out);

/* The angle, rad, that a pulse asks for, within the stops; and the pulse, us, of an angle. */
double motor_position_angle_of(const motor_position_parameters *p, double pulse_us);
double motor_position_pulse_of(const motor_position_parameters *p, double angle);

/* At rest at an angle, before any pulse. */
void motor_position_init(motor_position *self, double angle);

/* A pulse ends now. Returns 1, or 0 for a width that no servo takes (outside 500 to 2500 us). */
int motor_position_pulse(const motor_position_parameters *p, motor_position *self, double pulse_us);

/* Moves the shaft for `dt` seconds. `supply`: share of the nominal voltage. */
void motor_position_step(const motor_position_parameters *p, motor_position *self, double supply, double dt);
/* python: end */

#endif
