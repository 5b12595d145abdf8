/* infrared_proximity.c: see infrared_proximity.h. */
#include "infrared_proximity.h"

#include <math.h>

int infrared_proximity_init(infrared_proximity *self, const infrared_proximity_parameters *p) {
  if (beam_init(&self->beam, &p->beam)) return -1;
  if (!(p->range >= 0.0 && p->c1 >= 0.0 && p->c2 >= 0.0 && p->sigma >= 0.0)) return -1;
  if (!isfinite(p->range + p->c1 + p->c2 + p->sigma)) return -1;
  self->range = p->range * (1.0 + 0x1p-52); /* a ray reads 0 only beyond D, scene_ray's reach itself is out */
  self->c1 = p->c1;
  self->c2 = p->c2;
  self->sigma = p->sigma;
  self->reflectance = p->reflectance;
  return 0;
}

double infrared_proximity_read(const infrared_proximity *self, const viewpoint *from, noise_source *noise) {
  double distances[BEAM_RAYS];
  double c1[BEAM_RAYS];
  if (self->reflectance) { /* each surface reflects in its own way */
    const beam_origin at = beam_from(&self->beam, from);
    for (int i = 0; i < self->beam.rays; i++) {
      ray_hit hit = {.infrared = 0.0};
      distances[i] = beam_ray(&self->beam, from, at, i, self->range, &hit);
      c1[i] = self->c1 * hit.infrared;
    }
  } else {
    const fan_question question = infrared_proximity_ask(self, from, distances);
    arena_fans(&question, 1);
    scene_fan_movers(from->around, &question, from->id);
    for (int i = 0; i < self->beam.rays; i++) c1[i] = self->c1;
  }
  double sum = 0.0;
  for (int i = 0; i < self->beam.rays; i++)
    sum += infrared_proximity_ray(c1[i], self->c2, distances[i], self->beam.inward[i]);
  return infrared_proximity_of(self, sum, self->sigma > 0.0 ? noise_next_normal(noise) : 0.0);
}

/* ---- of a robot without a board ----------------------------------------------------------------------------------- */

static size_t make(void *self, const void *parameters) { return infrared_proximity_init(self, parameters) == 0; }

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  (void)memory;
  *readings = infrared_proximity_read(self, &s->from, noise);
}

static const sensor_kind KIND = {.noise = 1, .size = sizeof(infrared_proximity), .make = make, .read = read};
const sensor_kind *const infrared_proximity_sensor = &KIND;
