/* battery.c: see battery.h. */
#include "battery.h"

#include <string.h>

void battery_init(battery *self, const part_place *place, uint8_t channel, const battery_parameters *parameters) {
  memset(self, 0, sizeof *self);
  self->place = *place;
  self->channel = channel;
  self->parameters = *parameters;
  supply_init(&parameters->supply, &self->supply, 1.0);
}

void battery_step(battery *self, double servos_a, int at_charger, double dt) {
  supply_step(&self->parameters.supply, &self->supply, servos_a, at_charger, dt);
}

double battery_sample(battery *self) {
  const double noise = self->parameters.noise_v * noise_next_normal(&self->place.noise);
  const double v = self->supply.pack_v * self->parameters.divider + noise;
  return v < 0.0 ? 0.0 : (v > SUPPLY_NOMINAL_V ? SUPPLY_NOMINAL_V : v);
}
