/* laser.h: a laser range finder: a fan of thin beams, as the Hokuyo URG-04LX (notes, section 3.2.3).
 *
 * S_i is the distance along ray i, from right to left, or -1 beyond the range; noise by (3.1) for each ray, clamped to
 * [0, D]. 683 directions over 239.77 degrees (steps 44 ... 725 of 1024 to a turn, the middle one is straight ahead,
 * after Hokuyo's data sheet).
 */
#ifndef SENSORS_LASER_H
#define SENSORS_LASER_H

#include "geometry/scan.h"
#include "sensor.h"

#define LASER_RAYS 4096

/* python: begin */
typedef struct {
  double x, y, heading, height; /* on the body: m, m, rad, m */
  double first;                 /* rad from the middle, counter-clockwise, of ray 0; URG-04LX: -341 steps */
  double step;                  /* rad from ray to ray; URG-04LX: 2 pi / 1024 (data) */
  int rays;                     /* 1 to 4096; URG-04LX: 683 (notes) */
  double range;                 /* D, m; 4.0 (notes) */
  double sigma;                 /* of (3.1); 0.01 (data: 1 %); 0: no noise */
} laser_parameters;

typedef struct laser laser;

/* A laser; it serves one thread at a time. NULL without memory. */
laser *laser_new(const laser_parameters *parameters);
void laser_destroy(laser *self);

/* One scan into `distances`, as many as there are rays. */
void laser_scan(laser *self, const viewpoint *from, noise_source *noise, double *distances);

extern const sensor_kind laser_sensor;
/* python: end */

#endif
