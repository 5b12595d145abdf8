/* line.c: see line.h. */
#include "line.h"

#include <math.h>

#define SPOTS 9 /* at which the spot is sampled: its middle, and two rings of four */
#define LEAST 1e-6

int reflectance_init(reflectance *self, const reflectance_parameters *p) {
  if (!isfinite(p->x + p->y + p->radius + p->dark + p->sigma + p->gain)) return -1;
  if (!(p->radius >= 0.0 && p->dark >= 0.0 && p->sigma >= 0.0 && p->gain >= 0.0)) return -1;
  self->parameters = *p;
  return 0;
}

double reflectance_read(const reflectance *self, const viewpoint *from, noise_source *noise) {
  static const double spot[SPOTS][2] = {
      {0.0, 0.0}, {0.5, 0.0}, {-0.5, 0.0}, {0.0, 0.5}, {0.0, -0.5}, {0.7, 0.7}, {-0.7, 0.7}, {0.7, -0.7}, {-0.7, -0.7},
  };
  const reflectance_parameters *p = &self->parameters;
  double sum = 0.0;
  for (int i = 0; i < SPOTS; i++) {
    const double ahead = p->x + p->radius * spot[i][0];
    const double aside = p->y + p->radius * spot[i][1];
    const double x = from->x + ahead * from->cosine - aside * from->sine; /* (3.9) */
    const double y = from->y + ahead * from->sine + aside * from->cosine;
    sum += arena_floor_reflectance(from->around->arena, x, y);
  }
  const double spread = p->sigma > 0.0 ? 1.0 + p->sigma * noise_next_normal(noise) : 1.0; /* (3.1) */
  const double seen = p->gain * (sum / SPOTS + p->dark) * spread;
  return seen > LEAST ? seen : LEAST;
}

/* ---- of a robot without a board ----------------------------------------------------------------------------------- */

static size_t make(void *self, const void *parameters) { return reflectance_init(self, parameters) == 0; }

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  *readings = reflectance_read(self, &s->from, noise);
}

const sensor_kind reflectance_sensor = {.noise = 12, .size = sizeof(reflectance), .make = make, .read = read};
