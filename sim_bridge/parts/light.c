/* light.c: see light.h. */
#include "light.h"

typedef struct {
  capacitor capacitor;
  double decay_s, maximum_s;
  phototransistor phototransistor;
} light_sensor;

static double decay_time(capacitor *base, uint64_t cycle) {
  light_sensor *self = (light_sensor *)base;
  const viewpoint from = part_view(&base->part, cycle);
  const double irradiance = phototransistor_read(&self->phototransistor, &from, &base->part.noise);
  return phototransistor_decay_time(irradiance, self->decay_s, self->maximum_s);
}

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  light_sensor *self = (light_sensor *)base;
  const light_sensor_parameters *p = parameters;
  if (phototransistor_init(&self->phototransistor, &p->light) != 0) return -1;
  self->decay_s = p->decay_s;
  self->maximum_s = p->maximum_s;
  capacitor_init(&self->capacitor, place, pins[0], &p->capacitor, decay_time);
  return 0;
}

const part_kind light_kind = {.size = sizeof(light_sensor), .noise = 71, .pins = 1, .init = init};
