/* line.h: a sensor that looks at the floor below it: an infra-red LED lights the floor, and a phototransistor sees what comes
 * back. The law is the kit's own (docs/reference/notes.md): a current in proportion to the floor's reflectance, averaged
 * over the spot that the LED lights, and a little of the dark.
 */
#ifndef SENSORS_LINE_H
#define SENSORS_LINE_H

#include "sensor.h"

/* python: begin */
typedef struct {
  double x, y;   /* on the body, m */
  double radius; /* of the spot on the floor, m */
  double dark;   /* reflectance that a black hole would seem to have: leakage, stray light */
  double sigma;  /* of (3.1); 0: no noise */
  double gain;   /* of this unit, 1: nominal */
} reflectance_parameters;

typedef struct {
  reflectance_parameters parameters;
} reflectance;

/* 0, or -1: a number that is not finite or negative. */
int reflectance_init(reflectance *self, const reflectance_parameters *parameters);

/* Share of the light that comes back, above 0. */
double reflectance_read(const reflectance *self, const viewpoint *from, noise_source *noise);

extern const sensor_kind reflectance_sensor;
/* python: end */

#endif
