/* table.c: see table.h. */
#include "table.h"

#include <math.h>

#include "geometry/numbers.h"

typedef struct {
  beam beam;
  const table_noise *table;
  double reach, none;
} table;

static size_t make(void *self, const void *parameters) {
  const table_parameters *p = parameters;
  table *t = self;
  t->table = p->table;
  t->reach = p->reach;
  t->none = p->none;
  return beam_init(&t->beam, &p->beam) == 0;
}

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  const table *t = self;
  const beam_origin at = beam_from(&t->beam, &s->from);
  double nearest = -1.0;
  double angle = 0.0;
  for (int i = 0; i < t->beam.rays; i++) {
    ray_hit hit;
    const double d = beam_ray(&t->beam, &s->from, at, i, nearest < 0.0 ? t->reach : nearest, &hit);
    if (d < 0.0) continue;
    double cosine, sine;
    beam_direction(&t->beam, &s->from, i, &cosine, &sine);
    const double along = -(cosine * hit.normal_x + sine * hit.normal_y);
    const double across = cosine * hit.normal_y - sine * hit.normal_x;
    nearest = d;
    angle = number_atan2(fabs(across), along);
  }
  *readings = nearest < 0.0 ? t->none : table_noise_read(t->table, nearest, angle, noise);
}

const sensor_kind table_sensor = {.noise = 9, .size = sizeof(table), .make = make, .read = read};
