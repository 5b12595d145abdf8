/* compass.h: a magnetic compass: heading by the horizontal field that it measures in the body's frame.
 *
 * Without disturbance it reads wrap(heading + bias + sigma xi) (ARSim's GetCompassReading; notes, section
 * 3.2.3). Iron on the robot shifts the field (hard iron: found as the centre of the circle in one full turn in place), and
 * so do the motors' currents.
 */
#ifndef SENSORS_COMPASS_H
#define SENSORS_COMPASS_H

#include "sensor.h"

/* python: begin */
typedef struct {
  double sigma;                /* rad; chosen: 0.05; 0: no noise */
  double bias;                 /* rad: turned mounting; of the unit; 0: none */
  double iron_x, iron_y;       /* hard iron, in parts of the earth's horizontal field; of the unit; 0: none */
  double current_x, current_y; /* the same for each ampere of motor current; 0: none */
} compass_parameters;

/* The field in the body's frame, x forward, y left, in parts of the earth's horizontal field, which points along the
 * world's x axis; `current` in A is the sum of the motors'. */
void compass_field(const compass_parameters *self, const viewpoint *from, double current, double *x, double *y);

/* Heading, rad in (-pi, pi]. */
double compass_read(const compass_parameters *self, const viewpoint *from, double current, noise_source *noise);

extern const sensor_kind compass_sensor;
/* python: end */

#endif
