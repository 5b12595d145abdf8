/* charge.h: the notes' battery as it is read: a voltage in proportion to its charge, with noise.
 */
#ifndef SENSORS_CHARGE_H
#define SENSORS_CHARGE_H

#include "sensor.h"

/* python: begin */
typedef struct {
  double empty, full; /* V */
  double sigma;       /* V; 0: no noise */
} charge_parameters;

extern const sensor_kind charge_sensor;
/* python: end */

#endif
