/* light.h: a phototransistor that discharges a capacitor: one pin charges it and times its decay.
 *
 * The board raises the pin: the capacitor charges through a resistor. The board lets go: the current of the
 * phototransistor (world/sensors/light), in proportion to the light, takes the charge away, and the pin reads low once
 * the voltage is below the input's threshold. The more light, the shorter. What was not charged in full decays sooner.
 */
#ifndef PART_LIGHT_H
#define PART_LIGHT_H

#include "../world/sensors/light.h"
#include "part.h"

/* python: begin */
typedef struct {
  phototransistor_parameters light;
  double decay_s;     /* from the full charge to the threshold at irradiance 1 */
  double maximum_s;   /* in darkness: leakage ends it */
  double charge_s;    /* time constant of charging: resistor times capacitor */
  double threshold_v; /* of the falling input */
} light_sensor_parameters;
/* python: end */

typedef struct {
  part part;
  light_sensor_parameters parameters;
  phototransistor phototransistor;
  uint8_t charging;
  double volts;       /* on the capacitor when `since` began */
  uint64_t since;     /* charging or decaying */
  double decay_per_s; /* volts that the decay under way takes per second */
  double irradiance;  /* at the last reading */
} light_sensor;

/* python: begin */
/* Parameters: light_sensor_parameters. Pin: the capacitor. */
extern const part_kind *const light_kind;
/* python: end */

#endif
