/* odometer.h: a pose estimated from the travel of the wheels, (2.7)-(2.9) of the notes, by the midpoint rule.
 *
 * Two kinds of noise, either can be off: that of ARSim's GetOdometerReading, sigma xi metres per wheel and step of 10 ms
 * (scaled by the root of the step, so that drift does not depend on it); and the kit's, a factor per wheel, spread
 * in proportion to the travel, whole edges only, and slips that lose edges.
 */
#ifndef SENSORS_ODOMETER_H
#define SENSORS_ODOMETER_H

#include <math.h>

#include "geometry/numbers.h"
#include "sensor.h"

#define ODOMETER_ARSIM_STEP_S 0.01

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

/* 0, or -1: a number is not finite, a length or factor not positive, a spread or rate negative, or an unknown rule. */
int odometer_check(const odometer_parameters *parameters);

/* The estimate becomes this pose, the wheels' angles its reference: once, before the start. */
void odometer_calibrate(odometer_state *state, double x, double y, double heading, double wheel_left,
                        double wheel_right);

/* (2.7)-(2.9) for the travel of the wheels, m. */
void odometer_advance(const odometer_parameters *self, odometer_state *state, double left, double right);

/* The wheels have come to these angles in `dt` s. */
void odometer_step(const odometer_parameters *self, odometer_state *state, double wheel_left, double wheel_right,
                   double dt, noise_source *noise);

extern const sensor_kind *const odometer_sensor;
/* python: end */

/* 1 if nothing but the noise of sigma_step comes between the wheels' travel and the estimate. */
static inline int odometer_is_plain(const odometer_parameters *p) {
  return !(p->sigma_share > 0.0) && !(p->slips_per_s > 0.0) && !(p->edges_per_turn > 0.0);
}

/* What the odometer believes a wheel has travelled that turned by `angle`. */
NUMBERS_INLINE double odometer_travel(const odometer_parameters *p, double angle, double factor) {
  return factor * angle * p->wheel_radius;
}

/* Spread of the travel of a wheel in `dt` s. */
NUMBERS_INLINE double odometer_spread(const odometer_parameters *p, double dt) {
  return (dt == ODOMETER_ARSIM_STEP_S ? 1.0 : sqrt(dt / ODOMETER_ARSIM_STEP_S)) * p->sigma_step;
}

/* Share of a step's turn that is made before its travel is laid off. */
static inline double odometer_share(const odometer_parameters *p) {
  return p->rule == ODOMETER_MIDPOINT ? 0.5 : (p->rule == ODOMETER_EULER ? 0.0 : 1.0);
}

/* (2.7)-(2.9) */
NUMBERS_INLINE void odometer_lay_off(double half_track, double share, double left, double right, double *x, double *y,
                                     double *heading, double *distance) {
  const double travel = 0.5 * (left + right);
  const double turn = (right - left) / (2.0 * half_track);
  double sine, cosine;
  number_sincos(*heading + share * turn, &sine, &cosine);
  *x += travel * cosine;
  *y += travel * sine;
  *heading = number_wrap(*heading + turn);
  *distance += fabs(travel);
}

#endif
