/* line.c: see line.h. */
#include "line.h"

#include <math.h>

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
  if (!(p->decay_s > 0.0 && isfinite(p->decay_s))) return -1;
  self->decay_s = p->decay_s;
  return capacitor_init(&self->capacitor, place, pins[0], &p->capacitor, decay_time);
}

static const part_kind KIND = {.size = sizeof(line_part), .noise = 96, .pins = 1, .init = init};
const part_kind *const line_kind = &KIND;
