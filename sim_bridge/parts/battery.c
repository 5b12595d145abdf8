/* battery.c: see battery.h. */
#include "battery.h"

#include <string.h>

void battery_init(battery *self, const part_place *place, uint8_t channel, const battery_parameters *parameters) {
  memset(self, 0, sizeof *self);
  self->place = *place;
  self->channel = channel;
  self->parameters = *parameters;
  battery_step(self, 0.0, 0.0);
}

void battery_step(battery *self, double servo_a, double dt) {
  const battery_parameters *p = &self->parameters;
  const double current = p->board_a + servo_a;
  self->drawn_as += current * dt;
  double left = 1.0 - self->drawn_as / p->capacity_as;
  if (left < 0.0) left = 0.0;
  self->pack_v = p->empty_v + (p->full_v - p->empty_v) * left - p->resistance_ohm * current;
  if (self->pack_v < 0.0) self->pack_v = 0.0;
  self->regulated_v = self->pack_v - p->drop_out_v;
  if (self->regulated_v > BATTERY_NOMINAL_V) self->regulated_v = BATTERY_NOMINAL_V;
  if (self->regulated_v < 0.0) self->regulated_v = 0.0;
}

double battery_sample(battery *self) {
  const double v =
      self->pack_v * self->parameters.divider + self->parameters.noise_v * noise_next_normal(&self->place.noise);
  return v < 0.0 ? 0.0 : (v > BATTERY_NOMINAL_V ? BATTERY_NOMINAL_V : v);
}
