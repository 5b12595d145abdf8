/* supply.h: the battery pack, its sagging under load, the regulator, the rails, and the charger.
 *
 * Pack voltage = open-circuit voltage (a straight line against the charge left) - internal resistance * current. The regulator
 * gives 5 V until the pack comes within its drop-out; servos hang on it (Shield-Bot) or on the pack itself (the classic
 * Boe-Bot). Below 3.78 V a controller at 16 MHz is out of its specification and erratic; below 2.7 V its brown-out
 * detector holds it in reset (section 1.4 of the hardware's fact sheet). The notes' battery without volts is `energy`.
 */
#ifndef WORLD_SUPPLY_H
#define WORLD_SUPPLY_H

/* python: begin */
typedef struct {
  double full_v, empty_v; /* open-circuit voltage of the pack */
  double capacity_as;     /* A s between full and empty */
  double resistance_ohm;  /* internal */
  double drop_out_v;      /* of the regulator */
  double board_a;         /* drawn by the board */
  double servo_idle_a;    /* by a servo that gets pulses */
  double servo_run_a_s_m; /* and by its speed at the rim */
  double servo_a_per_n_m; /* and by its torque */
  double charger_a;       /* flows into the pack at a charging station */
  double unregulated;     /* 1: servos hang on the pack */
} supply_parameters;

typedef struct {
  double charge;  /* left, 0 to 1 */
  double pack_v;  /* at the pack's terminals */
  double board_v; /* behind the regulator */
  double servo_v; /* what the servos get */
} supply;

/* What one servo draws, A, at that speed of the rim and that torque. `pulsed`: it gets pulses. */
double supply_servo_current(const supply_parameters *p, int pulsed, double speed, double torque);

/* A pack with that much charge, loaded by the board alone. */
void supply_init(const supply_parameters *p, supply *self, double charge);

/* `dt` seconds under the load of all motors, A; `at_charger`: the robot stands at a charging station. */
void supply_step(const supply_parameters *p, supply *self, double motors_a, int at_charger, double dt);

/* That voltage at the pack's terminals, and what the rails have then. */
void supply_sag(const supply_parameters *p, supply *self, double pack_v);

/* An energy E in [0, 1], the kit's own: it falls by p_0 and by p_m per motor signal, and rises by p_c at a charger, all
 * 1/s. Returns E after `dt`. */
typedef struct {
  double idle_per_s;    /* p_0 */
  double signal_per_s;  /* p_m */
  double charger_per_s; /* p_c */
} energy_parameters;
double energy_step(const energy_parameters *p, double energy, double left, double right, int at_charger, double dt);
/* python: end */

#define SUPPLY_NOMINAL_V 5.0
#define SUPPLY_ERRATIC_V 3.78 /* what 16 MHz needs */
#define SUPPLY_RESET_V 2.7    /* brown-out fuse */

#endif
