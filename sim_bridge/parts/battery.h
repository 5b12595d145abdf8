/* battery.h: the pack that everything runs on (world/supply), and a share of its voltage, with noise, at an analog pin.
 *
 * On a charging station of the arena it takes charge. Fault: sagging, to at most that many V at the pack's terminals.
 */
#ifndef PART_BATTERY_H
#define PART_BATTERY_H

#include "../world/supply.h"
#include "part.h"

/* python: begin */
typedef struct {
  supply_parameters supply;
  double divider; /* pin voltage / pack voltage */
  double noise_v; /* standard deviation of one sample at the pin */
  double charge;  /* left at the beginning, 0 to 1 */
} battery_parameters;
/* python: end */

typedef struct {
  part part;
  battery_parameters parameters;
  supply supply;
} battery;

#define BATTERY_NOISE 51u /* key of its noise */

/* A battery that is measured at analog channel 0..5, or at none (PART_NO_PIN). */
void battery_init(battery *self, const part_place *place, uint8_t channel, const battery_parameters *parameters);

#endif
