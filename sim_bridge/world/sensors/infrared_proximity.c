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

/* (3.13): min((c1 / d^2 + c2) cos(kappa), 1), without dividing by a square that may be 0 */
static double seen(double c1, double c2, double d, double inward) {
  const double squared = d * d;
  const double product = (c1 + c2 * squared) * inward;
  return product < squared ? product / squared : 1.0;
}

/* The sum of all rays' readings where each surface reflects in its own way. */
static double sum_by_reflectance(const infrared_proximity *self, const viewpoint *from, beam_origin at) {
  double sum = 0.0;
  for (int i = 0; i < self->beam.rays; i++) {
    ray_hit hit;
    const double d = beam_ray(&self->beam, from, at, i, self->range, &hit);
    if (d >= 0.0) sum += seen(self->c1 * hit.infrared, self->c2, d, self->beam.inward[i]);
  }
  return sum;
}

static double sum_of_all(const infrared_proximity *self, const viewpoint *from, beam_origin at) {
  double distances[BEAM_RAYS];
  double sum = 0.0;
  beam_fan(&self->beam, from, at, self->range, distances);
  for (int i = 0; i < self->beam.rays; i++) {
    if (distances[i] >= 0.0) sum += seen(self->c1, self->c2, distances[i], self->beam.inward[i]);
  }
  return sum;
}

double infrared_proximity_read(const infrared_proximity *self, const viewpoint *from, noise_source *noise) {
  const beam_origin at = beam_from(&self->beam, from);
  const double sum = self->reflectance ? sum_by_reflectance(self, from, at) : sum_of_all(self, from, at);
  double s = sum / (double)self->beam.rays;                                 /* (3.12) */
  if (self->sigma > 0.0) s *= 1.0 + self->sigma * noise_next_normal(noise); /* (3.1) */
  return s > 1.0 ? 1.0 : (s > 0.0 ? s : 0.0);
}

double infrared_proximity_inverse(const infrared_proximity *self, double reading) {
  if (!(reading > self->c2 && reading < 1.0)) return -1.0;
  return sqrt(self->c1 / (reading - self->c2));
}
