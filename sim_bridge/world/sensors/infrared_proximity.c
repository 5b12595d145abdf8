/* infrared_proximity.c: see infrared_proximity.h. */
#include "infrared_proximity.h"

#include <math.h>

#include "geometry/lanes.h"

int infrared_proximity_init(infrared_proximity *self, const infrared_proximity_parameters *p) {
  if (beam_init(&self->beam, &p->beam)) return -1;
  if (!(p->range >= 0.0 && p->c1 >= 0.0 && p->c2 >= 0.0 && p->sigma >= 0.0)) return -1;
  if (!isfinite(p->range + p->c1 + p->c2 + p->sigma)) return -1;
  self->range = p->range * (1.0 + 0x1p-52); /* a ray reads 0 only beyond D, scene_ray's reach itself is out */
  for (int i = 0; i < BEAM_RAYS; i++) self->c1[i] = p->c1;
  self->c2 = p->c2;
  self->sigma = p->sigma;
  self->reflectance = p->reflectance;
  return 0;
}

/* The sum of all rays' readings; `c1` and `distances` by ray. */
LANES_INLINE double sum_of(const infrared_proximity *self, const double *c1, const double *distances) {
  double readings[BEAM_RAYS];
  double sum = 0.0;
  for (int first = 0; first < self->beam.rays; first += (int)RAY_FAN_GROUP) {
    for (int i = first; i < first + (int)RAY_FAN_GROUP; i++) {
      readings[i] = infrared_proximity_ray(c1[i], self->c2, distances[i], self->beam.inward[i]);
    }
  }
  for (int i = 0; i < self->beam.rays; i++) sum += readings[i];
  return sum;
}

LANES_INLINE void infrared_proximity_sums_inline(const infrared_proximity *const sensors[],
                                                 const fan_question answered[], size_t count, double sums[]) {
  for (size_t i = 0; i < count; i++) sums[i] = sum_of(sensors[i], sensors[i]->c1, answered[i].distances);
}

LANES_FUNCTION(extern, infrared_proximity_sums,
               (const infrared_proximity *const sensors[], const fan_question answered[], size_t count, double sums[]),
               (sensors, answered, count, sums))

/* Where each surface reflects in its own way. */
LANES_NOT_INLINE static double sum_by_reflectance(const infrared_proximity *self, const viewpoint *from) {
  const beam_origin at = beam_from(&self->beam, from);
  double distances[BEAM_RAYS] = {0.0};
  double c1[BEAM_RAYS] = {0.0};
  for (int i = 0; i < self->beam.rays; i++) {
    ray_hit hit = {.infrared = 0.0};
    distances[i] = beam_ray(&self->beam, from, at, i, self->range, &hit);
    c1[i] = self->c1[i] * hit.infrared;
  }
  return sum_of(self, c1, distances);
}

double infrared_proximity_read(const infrared_proximity *self, const viewpoint *from, noise_source *noise) {
  double sum;
  if (self->reflectance) {
    sum = sum_by_reflectance(self, from);
  } else {
    double distances[BEAM_RAYS];
    const fan_question question = infrared_proximity_ask(self, from, distances);
    arena_fans(&question, 1);
    scene_fan_movers(from->around, &question, from->id);
    infrared_proximity_sums(&self, &question, 1, &sum);
  }
  return infrared_proximity_finish(self, sum, noise);
}
