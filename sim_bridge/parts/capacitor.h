/* capacitor.h: a pin that charges a capacitor and times its decay, as light and line sensors have it.
 *
 * The board raises the pin: the capacitor charges through a resistor. The board lets go: a current that is constant during
 * the decay takes the charge away, and the pin reads low once the voltage is below the input's threshold. The greater the
 * current, the sooner. What was not charged in full decays sooner. Fault: dirty, a share of the light, and so of the current,
 * is lost.
 */
#ifndef PART_CAPACITOR_H
#define PART_CAPACITOR_H

#include "part.h"

/* python: begin */
typedef struct {
  double charge_s;    /* time constant of charging: resistor times capacitor; 0: at once */
  double threshold_v; /* of the falling input */
} capacitor_parameters;
/* python: end */

typedef struct capacitor capacitor;

/* Time from the full charge to the threshold if the board lets go at that cycle, s. */
typedef double (*capacitor_decay)(capacitor *self, uint64_t cycle);

struct capacitor {
  part part;
  capacitor_parameters parameters;
  capacitor_decay decay_time;
  uint8_t charging;
  double volts;       /* on the capacitor when `since` began */
  uint64_t since;     /* charging or decaying */
  double decay_per_s; /* volts that the decay under way takes per second */
};

/* A part that begins with a capacitor, at that pin. */
void capacitor_init(capacitor *self, const part_place *place, uint8_t pin, const capacitor_parameters *parameters,
                    capacitor_decay decay_time);

#endif
