/* light.h: a light sensor: a phototransistor that discharges a capacitor (capacitor.h), the sooner, the more light. */
#ifndef PART_LIGHT_H
#define PART_LIGHT_H

#include "../world/sensors/light.h"
#include "capacitor.h"

/* python: begin */
typedef struct {
  phototransistor_parameters light;
  capacitor_parameters capacitor;
  double decay_s;   /* from the full charge to the threshold at irradiance 1 */
  double maximum_s; /* in darkness: leakage ends it */
} light_sensor_parameters;

/* Parameters: light_sensor_parameters. Pin: the capacitor. */
extern const part_kind light_kind;
/* python: end */

#endif
