/* infrared_proximity.c: see infrared_proximity.h. */
#include "infrared_proximity.h"

#include <math.h>

int infrared_proximity_init(infrared_proximity *self, const infrared_proximity_parameters *p) {
  if (beam_init(&self->beam, &p->beam)) return -1;
  self->range = p->range * (1.0 + 0x1p-52); /* a ray reads 0 only beyond D, scene_ray's reach itself is out */
  self->c1 = p->c1;
  self->c2 = p->c2;
  self->sigma = p->sigma;
  self->reflectance = p->reflectance;
  return 0;
}

/* (3.13): min((c1 / d^2 + c2) cos(kappa), 1), without dividing by a square that may be 0; 0 where nothing was met. `inward`:
 * cos(kappa). */
static double reading_of(double c1, double c2, double distance, double inward) {
  const double squared = distance * distance;
  const double product = (c1 + c2 * squared) * inward;
  const double limited = product < squared ? product / squared : 1.0;
  return distance >= 0.0 ? limited : 0.0;
}

double infrared_proximity_read(const infrared_proximity *self, const viewpoint *from, noise_source *noise) {
  const beam *rays = &self->beam;
  double sum = 0.0;
  if (self->reflectance) { /* each surface reflects in its own way */
    const beam_origin at = beam_from(rays, from);
    for (int i = 0; i < rays->rays; i++) {
      ray_hit hit = {.infrared = 0.0};
      const double distance = beam_ray(rays, from, at, i, self->range, &hit);
      sum += reading_of(self->c1 * hit.infrared, self->c2, distance, rays->inward[i]);
    }
  } else {
    double distances[BEAM_RAYS];
    beam_rays(rays, from, self->range, distances);
    for (int i = 0; i < rays->rays; i++) sum += reading_of(self->c1, self->c2, distances[i], rays->inward[i]);
  }
  const double draw = self->sigma > 0.0 ? noise_next_normal(noise) : 0.0;
  const double exact = sum / (double)rays->rays;           /* (3.12) */
  const double noisy = exact * (1.0 + self->sigma * draw); /* (3.1) */
  const double least = noisy > 0.0 ? noisy : 0.0;
  return least < 1.0 ? least : 1.0;
}

/* ---- of a robot without a board ----------------------------------------------------------------------------------- */

static size_t make(void *self, const void *parameters) { return infrared_proximity_init(self, parameters) == 0; }

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  *readings = infrared_proximity_read(self, &s->from, noise);
}

const sensor_kind infrared_proximity_sensor = {
    .noise = 1, .size = sizeof(infrared_proximity), .make = make, .read = read};
