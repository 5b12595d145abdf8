/* infrared_pair.c: see infrared_pair.h. */
#include "infrared_pair.h"

#include <math.h>

#include "geometry/numbers.h"

double infrared_carrier_share(double frequency) {
  /* Sensitivity against frequency, relative to its peak; 38 kHz stands for the whole range. */
  static const double kilohertz[] = {33.0, 35.0, 36.5, 38.0, 38.5, 39.0, 40.0, 41.0, 42.0, 45.0};
  static const double sensitivity[] = {0.02, 0.15, 0.55, 0.97, 1.00, 0.90, 0.50, 0.33, 0.20, 0.02};
  const double f = frequency * 1e-3;
  double s = 0.02;
  for (size_t i = 0; i + 1 < sizeof kilohertz / sizeof kilohertz[0]; i++) {
    if (f < kilohertz[i] || f > kilohertz[i + 1]) continue;
    s = sensitivity[i] + (sensitivity[i + 1] - sensitivity[i]) * (f - kilohertz[i]) / (kilohertz[i + 1] - kilohertz[i]);
    break;
  }
  return sqrt(s / 0.97);
}

int infrared_pair_init(infrared_pair *self, const infrared_pair_parameters *p) {
  if (beam_init(&self->beam, &p->beam)) return -1;
  if (!(p->range >= 0.0 && p->range_sigma >= 0.0 && p->direct >= 0.0 && p->false_hit >= 0.0 && p->false_hit <= 1.0))
    return -1;
  if (!isfinite(p->range + p->range_sigma + p->direct)) return -1;
  self->range = p->range;
  self->range_sigma = p->range_sigma;
  self->false_hit = p->false_hit;
  self->direct = p->direct;
  double unused;
  number_sincos(0.5 * p->beam.opening, &unused, &self->edge_cosine);
  return 0;
}

infrared_look infrared_pair_look(const infrared_pair *self, const viewpoint *from, double frequency,
                                 noise_source *noise) {
  const double spread = 1.0 + self->range_sigma * noise_next_normal(noise); /* (3.1) */
  const int falsely = noise_next_uniform(noise) < self->false_hit;
  infrared_look look = {.distance = -1.0};
  look.reach = self->range * infrared_carrier_share(frequency) * (spread > 0.0 ? spread : 0.0);
  const beam_origin at = beam_from(&self->beam, from);
  for (int i = 0; i < self->beam.rays; i++) {
    ray_hit hit;
    const double d = beam_ray(&self->beam, from, at, i, look.reach, &hit);
    if (d < 0.0 || d * d >= look.reach * look.reach * hit.infrared) continue;
    if (look.distance < 0.0 || d < look.distance) look.distance = d;
  }
  look.seen = falsely || look.distance >= 0.0;
  return look;
}

infrared_burst infrared_pair_burst(const infrared_pair *self, const viewpoint *from, double frequency) {
  const beam_origin at = beam_from(&self->beam, from);
  return (infrared_burst){
      .x = at.x,
      .y = at.y,
      .cosine = from->cosine * self->beam.middle_cosine - from->sine * self->beam.middle_sine,
      .sine = from->sine * self->beam.middle_cosine + from->cosine * self->beam.middle_sine,
      .edge_cosine = self->edge_cosine,
      .height = self->beam.height,
      .frequency = frequency,
      .id = from->id,
  };
}

int infrared_pair_sees_burst(const infrared_pair *self, const viewpoint *from, const infrared_burst *burst) {
  const infrared_burst own = infrared_pair_burst(self, from, burst->frequency); /* where the receiver looks */
  const double dx = burst->x - own.x;
  const double dy = burst->y - own.y;
  const double d = sqrt(dx * dx + dy * dy);
  if (burst->id == from->id || !(d < self->direct * infrared_carrier_share(burst->frequency))) return 0;
  if (d == 0.0) return 1;
  if (dx * own.cosine + dy * own.sine < own.edge_cosine * d) return 0;             /* not in the receiver's beam */
  if (-(dx * burst->cosine + dy * burst->sine) < burst->edge_cosine * d) return 0; /* not in the LED's */
  ray_hit hit;
  const double height = own.height < burst->height ? own.height : burst->height;
  const double free_way = scene_ray(from->around, own.x, own.y, dx / d, dy / d, d, height, from->id, &hit);
  /* The sender's own body may be met on the last bit of the way to its LED. */
  return free_way < 0.0 || (hit.shape < 0 && from->around->movers[-1 - hit.shape].id == burst->id);
}

/* ---- of a robot whose board is left out --------------------------------------------------------------------------- */

static size_t make(void *self, const void *parameters) { return infrared_pair_init(self, parameters) == 0; }

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  *readings = infrared_pair_look(self, &s->from, INFRARED_CARRIER_HZ, noise).seen;
}

const sensor_kind infrared_pair_sensor = {.noise = 14, .size = sizeof(infrared_pair), .make = make, .read = read};
