/* infrared_proximity.c: see infrared_proximity.h. */
#include "infrared_proximity.h"

#include <math.h>

#include "../lanes.h"

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

/* (3.13): min((c1 / d^2 + c2) cos(kappa), 1), without dividing by a square that may be 0; 0 where nothing was met. */
LANES_INLINE void see(const double *c1, double c2, const double *distances, const double *inward, double *readings) {
  lanes gain, d, towards;
  lanes_load(&gain, c1);
  lanes_load(&d, distances);
  lanes_load(&towards, inward);
  const lanes none = lanes_of(0.0);
  const lanes full = lanes_of(1.0);
  const lanes squared = d * d;
  const lanes product = (gain + c2 * squared) * towards;
  const lanes quotient = product / squared;
  const lanes limited = lanes_select(product < squared, quotient, full);
  const lanes seen = lanes_select(d >= 0.0, limited, none);
  lanes_store(readings, &seen);
}

/* The sum of all rays' readings; `c1` and `distances` by ray. */
LANES_INLINE double sum_of(const infrared_proximity *self, const double *c1, const double *distances) {
  double readings[BEAM_RAYS];
  double sum = 0.0;
  int first = 0;
  do {
    see(&c1[first], self->c2, &distances[first], &self->beam.inward[first], &readings[first]);
    first += (int)LANES;
  } while (first < self->beam.rays);
  for (int i = 0; i < self->beam.rays; i++) sum += readings[i];
  return sum;
}

LANES_NOT_INLINE static double sum_anywhere(const infrared_proximity *self, const double *c1, const double *distances) {
  return sum_of(self, c1, distances);
}

#ifdef LANES_AVX2
LANES_AVX2 static double sum_by_avx2(const infrared_proximity *self, const double *c1, const double *distances) {
  return sum_of(self, c1, distances);
}
#endif

static double sum_of_all(const infrared_proximity *self, const double *c1, const double *distances) {
#ifdef LANES_AVX2
  if (LANES_HAVE_AVX2()) return sum_by_avx2(self, c1, distances);
#endif
  return sum_anywhere(self, c1, distances);
}

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
  return sum_of_all(self, c1, distances);
}

fan_question infrared_proximity_ask(const infrared_proximity *self, const viewpoint *from, double *distances) {
  return beam_question(&self->beam, from, self->range, distances);
}

double infrared_proximity_answer(const infrared_proximity *self, const viewpoint *from, const fan_question *asked,
                                 noise_source *noise) {
  double sum;
  if (self->reflectance) {
    sum = sum_by_reflectance(self, from);
  } else {
    if (from->around->movers_count > 0) scene_fan_movers(from->around, asked, from->id);
    sum = sum_of_all(self, self->c1, asked->distances);
  }
  double s = sum / (double)self->beam.rays;                                 /* (3.12) */
  if (self->sigma > 0.0) s *= 1.0 + self->sigma * noise_next_normal(noise); /* (3.1) */
  s = s > 0.0 ? s : 0.0;                                                    /* each a single operation, no branch */
  return s < 1.0 ? s : 1.0;
}

double infrared_proximity_read(const infrared_proximity *self, const viewpoint *from, noise_source *noise) {
  double distances[BEAM_RAYS];
  const fan_question question = infrared_proximity_ask(self, from, distances);
  if (!self->reflectance) arena_fans(&question, 1);
  return infrared_proximity_answer(self, from, &question, noise);
}

double infrared_proximity_inverse(const infrared_proximity *self, double reading) {
  if (!(reading > self->c2 && reading < 1.0)) return -1.0;
  return sqrt(self->c1[0] / (reading - self->c2));
}
