/* odometer.h: a pose estimated from the travel of the wheels, (2.7)-(2.9) of the notes, by the midpoint rule.
 *
 * Two kinds of noise, either can be off: that of ARSim's GetOdometerReading, sigma xi metres per wheel and step of 10 ms
 * (scaled by the root of the step, so that drift does not depend on it); and the kit's, a factor per wheel, spread
 * in proportion to the travel, whole edges only, and slips that lose edges.
 */
#ifndef SENSORS_ODOMETER_H
#define SENSORS_ODOMETER_H

#include "sensor.h"

/* python: begin */
enum { ODOMETER_MIDPOINT = 0, ODOMETER_EULER = 1, ODOMETER_NEW_HEADING = 2 }; /* at which heading a step is laid off */

typedef struct {
  double half_track;                /* R as the odometer believes it, m */
  double wheel_radius;              /* r, m */
  int rule;                         /* ODOMETER_MIDPOINT; the others show why not (section 2.2) */
  double sigma_step;                /* ARSim: m per wheel in 10 ms; 0: none */
  double factor_left, factor_right; /* k_w of each wheel, 1 +- 0.01; of the unit; 1: none */
  double sigma_share;               /* sigma_s: relative spread of the travel of a step; 0: none */
  double edges_per_turn;            /* travel is seen in whole edges of 2 pi r / N; 0: exact */
  double slips_per_s;               /* per wheel; 0: never */
  double slip_share;                /* of a step's travel that is lost while the wheel slips */
} odometer_parameters;

typedef struct {
  double x, y, heading;           /* the estimate */
  double wheel_left, wheel_right; /* angles at the last reading, rad */
  double rest_left, rest_right;   /* travel not yet seen as an edge, m */
  double distance;                /* travelled by the estimate, m */
} odometer_state;

/* The estimate becomes this pose, the wheels' angles its reference: once, before the start. */
void odometer_calibrate(odometer_state *state, double x, double y, double heading, double wheel_left,
                        double wheel_right);

/* (2.7)-(2.9) for the travel of the wheels, m. */
void odometer_advance(const odometer_parameters *self, odometer_state *state, double left, double right);

/* The wheels have come to these angles in `dt` s. */
void odometer_step(const odometer_parameters *self, odometer_state *state, double wheel_left, double wheel_right,
                   double dt, noise_source *noise);

extern const sensor_kind odometer_sensor;
/* python: end */

#endif
