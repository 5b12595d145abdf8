/* light.c: see light.h. */
#include "light.h"

#include <math.h>

int phototransistor_init(phototransistor *self, const phototransistor_parameters *p) {
  const beam_parameters mount = {.x = p->x, .y = p->y, .heading = p->heading, .height = p->height, .rays = 1};
  if (beam_init(&self->mount, &mount)) return -1;
  if (!isfinite(p->near_distance + p->ambient + p->sigma + p->gain)) return -1;
  if (!(p->near_distance > 0.0 && p->ambient >= 0.0 && p->sigma >= 0.0 && p->gain >= 0.0)) return -1;
  self->near_squared = p->near_distance * p->near_distance;
  self->ambient = p->ambient;
  self->sigma = p->sigma;
  self->gain = p->gain;
  return 0;
}

double phototransistor_read(const phototransistor *self, const viewpoint *from, noise_source *noise) {
  const arena_light *lamps = arena_lights(from->around->arena);
  const size_t count = arena_light_count(from->around->arena);
  const beam_origin at = beam_from(&self->mount, from);
  double cosine, sine;
  beam_direction(&self->mount, from, 0, &cosine, &sine);
  double sum = self->ambient;
  for (size_t i = 0; i < count; i++) {
    const double dx = lamps[i].x - at.x;
    const double dy = lamps[i].y - at.y;
    const double squared = dx * dx + dy * dy;
    const double d = sqrt(squared);
    const double facing = d > 0.0 ? (dx * cosine + dy * sine) / d : 1.0; /* cos theta */
    if (facing <= 0.0) continue;
    if (d > 0.0 && scene_ray(from->around, at.x, at.y, dx / d, dy / d, d, self->mount.height, from->id, NULL) >= 0.0)
      continue;
    sum += lamps[i].power * facing / (self->near_squared + squared);
  }
  const double spread = self->sigma > 0.0 ? 1.0 + self->sigma * noise_next_normal(noise) : 1.0; /* (3.1) */
  const double l = self->gain * sum * spread;
  return l > 0.0 ? l : 0.0;
}

double phototransistor_decay_time(double irradiance, double scale, double maximum) {
  return irradiance * maximum > scale ? scale / irradiance : maximum;
}

/* ---- of a robot without a board ----------------------------------------------------------------------------------- */

static size_t make(void *self, const void *parameters) { return phototransistor_init(self, parameters) == 0; }

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  *readings = phototransistor_read(self, &s->from, noise);
}

const sensor_kind phototransistor_sensor = {.noise = 7, .size = sizeof(phototransistor), .make = make, .read = read};
