/* laser.c: see laser.h. */
#include "laser.h"

#include <math.h>
#include <stdlib.h>

#include "../numbers.h"

struct laser {
  laser_parameters parameters;
  beam mount; /* one ray: where the fan begins */
  double (*directions)[2];
};

static int usable(const laser_parameters *p) {
  if (p->rays < 1 || p->rays > LASER_RAYS || !(p->step >= 0.0) || !isfinite(p->first)) return 0;
  if (!(p->range > 0.0 && p->sigma >= 0.0) || !isfinite(p->range + p->sigma)) return 0;
  return p->step * (p->rays - 1) <= 2.0 * NUMBERS_PI + 1e-9 && fabs(p->first) <= 2.0 * NUMBERS_PI;
}

laser *laser_new(const laser_parameters *p) {
  laser *self = usable(p) ? calloc(1, sizeof *self) : NULL;
  if (self == NULL) return NULL;
  const beam_parameters mount = {.x = p->x, .y = p->y, .heading = p->heading, .height = p->height, .rays = 1};
  self->parameters = *p;
  self->directions = calloc((size_t)p->rays, sizeof *self->directions);
  if (self->directions == NULL || beam_init(&self->mount, &mount)) {
    laser_destroy(self);
    return NULL;
  }
  for (int i = 0; i < p->rays; i++) {
    const double angle = p->heading - p->first + (double)i * p->step;
    number_sincos(angle, &self->directions[i][1], &self->directions[i][0]);
  }
  return self;
}

void laser_destroy(laser *self) {
  if (self == NULL) return;
  free(self->directions);
  free(self);
}

void laser_scan(const laser *self, const viewpoint *from, noise_source *noise, double *distances) {
  const laser_parameters *p = &self->parameters;
  const beam_origin at = beam_from(&self->mount, from);
  for (int i = 0; i < p->rays; i++) {
    const double *direction = self->directions[i];
    const double cosine = from->cosine * direction[0] - from->sine * direction[1];
    const double sine = from->sine * direction[0] + from->cosine * direction[1];
    distances[i] = scene_ray(from->around, at.x, at.y, cosine, sine, p->range, p->height, from->id, NULL);
  }
  if (p->sigma <= 0.0 || !noise->on) return;
  for (int i = 0; i < p->rays; i++) {
    const double draw = noise_next_normal(noise); /* also where nothing is seen: each ray keeps its own sequence */
    if (distances[i] < 0.0) continue;
    const double d = distances[i] * (1.0 + p->sigma * draw); /* (3.1) */
    distances[i] = d < 0.0 ? 0.0 : (d > p->range ? p->range : d);
  }
}
