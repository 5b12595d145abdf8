/* battery.h: the pack, its sagging under load, and the 5 V regulator that board and servos run on.
 *
 * Pack voltage = open-circuit voltage (falls with the charge that was drawn) - internal resistance * current. The regulator
 * gives 5 V until the pack comes within its drop-out. Half of the pack voltage lies at the analog pin, if one is joined.
 */
#ifndef PART_BATTERY_H
#define PART_BATTERY_H

#include "part.h"

/* python: begin */
typedef struct {
  double full_v, empty_v; /* open-circuit voltage of the pack */
  double capacity_as;     /* A s between them */
  double resistance_ohm;  /* internal */
  double drop_out_v;      /* of the regulator */
  double board_a;         /* drawn by the board */
  double servo_idle_a;    /* by a servo that gets pulses */
  double servo_run_a_s_m; /* and by its speed at the rim */
  double servo_a_per_n_m; /* and by its torque */
  double divider;         /* pin voltage / pack voltage */
  double noise_v;         /* standard deviation of one sample at the pin */
} battery_parameters;
/* python: end */

typedef struct {
  part part;
  battery_parameters parameters;
  double drawn_as;
  double pack_v;
  double regulated_v;
} battery;

#define BATTERY_NOMINAL_V 5.0

/* A battery that is measured at analog channel 0..5, or at none (PART_NO_PIN). */
void battery_init(battery *self, const part_place *place, uint8_t channel, const battery_parameters *parameters);

#endif
