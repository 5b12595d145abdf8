/* sonar.c: see sonar.h. */
#include "sonar.h"

#include <math.h>

int sonar_init(sonar *self, const sonar_parameters *p) {
  if (beam_init(&self->beam, &p->beam)) return -1;
  if (!(p->range_minimum >= 0.0 && p->range_minimum < p->range_maximum && p->sigma >= 0.0)) return -1;
  if (!isfinite(p->range_maximum + p->sigma)) return -1;
  if (!(p->miss >= 0.0 && p->miss <= 1.0 && p->grazing_cosine >= 0.0 && p->grazing_cosine <= 1.0)) return -1;
  if (!(p->temperature >= -100.0 && p->temperature <= 200.0)) return -1;
  self->range_minimum = p->range_minimum;
  self->range_maximum = p->range_maximum;
  self->sigma = p->sigma;
  self->miss = p->miss;
  self->grazing_cosine = p->grazing_cosine;
  self->temperature = p->temperature;
  self->absorption = p->absorption;
  return 0;
}

double sonar_speed_of_sound(double temperature) { return 331.5 + 0.6 * temperature; }

double sonar_echo_time(const sonar *self, double distance) {
  return 2.0 * distance / sonar_speed_of_sound(self->temperature);
}

double sonar_distance(const sonar *self, const viewpoint *from) {
  const beam_origin at = beam_from(&self->beam, from);
  const int surface = self->grazing_cosine > 0.0 || self->absorption;
  double nearest = -1.0;
  for (int i = 0; i < self->beam.rays; i++) {
    ray_hit hit = {0};
    /* Only what is nearer than the best so far counts. */
    const double reach = nearest < 0.0 ? self->range_maximum : nearest;
    const double d = beam_ray(&self->beam, from, at, i, reach, surface ? &hit : NULL);
    if (d < 0.0) continue;
    if (surface) {
      double cosine, sine;
      beam_direction(&self->beam, from, i, &cosine, &sine);
      if (-(cosine * hit.normal_x + sine * hit.normal_y) < self->grazing_cosine) continue;
      if (self->absorption && d * d >= self->range_maximum * self->range_maximum * hit.sound) continue;
    }
    nearest = d;
  }
  return nearest;
}

double sonar_ping(const sonar *self, const viewpoint *from, noise_source *noise) {
  const double spread = 1.0 + self->sigma * noise_next_normal(noise); /* (3.1) */
  if (self->miss > 0.0 && noise_next_uniform(noise) < self->miss) return -1.0;
  double d = sonar_distance(self, from);
  if (d < 0.0) return -1.0;
  d *= spread;
  return d < self->range_minimum ? self->range_minimum : (d > self->range_maximum ? self->range_maximum : d);
}

double sonar_read(const sonar *self, const viewpoint *from, noise_source *noise) {
  const double d = sonar_ping(self, from, noise);
  return d < 0.0 ? self->range_maximum : d;
}

/* ---- of a robot without a board ----------------------------------------------------------------------------------- */

static size_t make(void *self, const void *parameters) { return sonar_init(self, parameters) == 0; }

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  *readings = sonar_read(self, &s->from, noise);
}

const sensor_kind sonar_sensor = {.noise = 3, .size = sizeof(sonar), .make = make, .read = read};

/* ---- of a robot whose board is left out --------------------------------------------------------------------------- */

static void read_echo(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise,
                      double *readings) {
  const double distance = sonar_ping(self, &s->from, noise);
  const double us = distance < 0.0 ? PING_NOTHING_US : floor(sonar_echo_time(self, distance) * 1e6 + 0.5);
  *readings = fmin(fmax(us, PING_SHORTEST_US), PING_NOTHING_US);
}

const sensor_kind ping_sensor = {.noise = 15, .size = sizeof(sonar), .make = make, .read = read_echo};
