/* line.c: see line.h. */
#include "line.h"

typedef struct {
  capacitor capacitor;
  double decay_s;
  reflectance sensor;
} line_part;

static double decay_time(capacitor *base, uint64_t cycle) {
  line_part *self = (line_part *)base;
  const viewpoint from = part_view(&base->part, cycle);
  return self->decay_s / reflectance_read(&self->sensor, &from, &base->part.noise);
}

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  line_part *self = (line_part *)base;
  const line_part_parameters *p = parameters;
  if (reflectance_init(&self->sensor, &p->floor) != 0) return -1;
  self->decay_s = p->decay_s;
  capacitor_init(&self->capacitor, place, pins[0], &p->capacitor, decay_time);
  return 0;
}

const part_kind line_kind = {.size = sizeof(line_part), .noise = 96, .pins = 1, .init = init};
