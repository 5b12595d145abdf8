/* battery.h: the pack at an analog pin: a share of its voltage, with noise, as the board samples it (world/supply). */
#ifndef PART_BATTERY_H
#define PART_BATTERY_H

#include "../world/supply.h"
#include "part.h"

/* python: begin */
typedef struct {
  supply_parameters supply;
  double divider; /* pin voltage / pack voltage */
  double noise_v; /* standard deviation of one sample at the pin */
} battery_parameters;
/* python: end */

typedef struct {
  part_place place;
  uint8_t channel; /* analog channel 0..5, or PART_NO_PIN */
  battery_parameters parameters;
  supply supply;
} battery;

void battery_init(battery *self, const part_place *place, uint8_t channel, const battery_parameters *parameters);

/* `servos_a`: what the servos draw in this step of `dt` seconds. */
void battery_step(battery *self, double servos_a, int at_charger, double dt);

/* Voltage at the analog pin, sampled now. */
double battery_sample(battery *self);

#endif
