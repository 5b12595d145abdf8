/* infrared_proximity.h: the notes' IR proximity sensor, (3.9)-(3.14), with noise by (3.1).
 *
 * S is the mean of the rays' readings; it grows from c2 cos(kappa) at the range's end to 1 close by. Surfaces reflect all
 * the same unless `reflectance` is on. Noise is drawn once per reading, not once per ray.
 */
#ifndef SENSORS_INFRARED_PROXIMITY_H
#define SENSORS_INFRARED_PROXIMITY_H

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

/* 0, or -1: a bad beam. */
int infrared_proximity_init(infrared_proximity *self, const infrared_proximity_parameters *parameters);

/* S in [0, 1]. */
double infrared_proximity_read(const infrared_proximity *self, const viewpoint *from, noise_source *noise);

extern const sensor_kind infrared_proximity_sensor;
/* python: end */

#endif
