/* infrared_proximity.h: the notes' IR proximity sensor, (3.9)-(3.14), with noise by (3.1).
 *
 * S is the mean of the rays' readings; it grows from c2 cos(kappa) at the range's end to 1 close by. Surfaces reflect all
 * the same unless `reflectance` is on. Noise is drawn once per reading, not once per ray.
 */
#ifndef SENSORS_INFRARED_PROXIMITY_H
#define SENSORS_INFRARED_PROXIMITY_H

#include "geometry/numbers.h"
#include "sensor.h"

/* python: begin */
typedef struct {
  beam_parameters beam; /* notes: 3 rays over 0.5 rad */
  double range;         /* D, m; notes: 1.0 */
  double c1;            /* m^2; notes: 0.03 */
  double c2;            /* notes: 0.1 */
  double sigma;         /* of (3.1); notes: 0.01; 0: no noise */
  int reflectance;      /* 1: the part of c1 is in proportion to the surface's infrared reflectance */
} infrared_proximity_parameters;

typedef struct {
  beam beam;
  double range, c1, c2, sigma;
  int reflectance;
} infrared_proximity;

/* 0, or -1: a bad beam, or a number that is not finite or negative. */
int infrared_proximity_init(infrared_proximity *self, const infrared_proximity_parameters *parameters);

/* S in [0, 1]. */
double infrared_proximity_read(const infrared_proximity *self, const viewpoint *from, noise_source *noise);

extern const sensor_kind *const infrared_proximity_sensor;
/* python: end */

/* The same in parts, for many sensors at once, all without `reflectance`: the question that arena_fans is to answer, what
 * each ray adds, and the reading. */
static inline fan_question infrared_proximity_ask(const infrared_proximity *self, const viewpoint *from,
                                                  double *distances) {
  return beam_question(&self->beam, from, self->range, distances);
}

/* (3.13): min((c1 / d^2 + c2) cos(kappa), 1), without dividing by a square that may be 0; 0 where nothing was met. `inward`:
 * cos(kappa). */
NUMBERS_INLINE double infrared_proximity_ray(double c1, double c2, double distance, double inward) {
  const double squared = distance * distance;
  const double product = (c1 + c2 * squared) * inward;
  const double limited = product < squared ? product / squared : 1.0;
  return distance >= 0.0 ? limited : 0.0;
}

/* The reading by a normal draw, 0 without noise. */
NUMBERS_INLINE double infrared_proximity_of(const infrared_proximity *self, double sum, double draw) {
  const double exact = sum / (double)self->beam.rays;      /* (3.12) */
  const double noisy = exact * (1.0 + self->sigma * draw); /* (3.1) */
  const double least = noisy > 0.0 ? noisy : 0.0;          /* each a single operation, no branch */
  return least < 1.0 ? least : 1.0;
}

#endif
