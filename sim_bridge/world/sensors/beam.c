/* beam.c: see beam.h. */
#include "beam.h"

#include <math.h>

#include "geometry/numbers.h"

int beam_init(beam *self, const beam_parameters *p) {
  if (!isfinite(p->x) || !isfinite(p->y) || !isfinite(p->height) || !(fabs(p->heading) < 1e4)) return -1;
  if (!(p->opening >= 0.0 && p->opening <= NUMBERS_PI) || p->rays < 1 || p->rays > BEAM_RAYS) return -1;
  *self = (beam){.x = p->x, .y = p->y, .height = p->height, .rays = p->rays};
  number_sincos(p->heading, &self->middle_sine, &self->middle_cosine);
  double cosine[BEAM_RAYS], sine[BEAM_RAYS];
  for (int i = 0; i < p->rays; i++) {
    const double share = p->rays > 1 ? (double)i / (double)(p->rays - 1) - 0.5 : 0.0;
    double unused;
    number_sincos(p->heading + share * p->opening, &sine[i], &cosine[i]); /* (3.10), (3.11) */
    number_sincos(share * p->opening, &unused, &self->inward[i]);
  }
  ray_fan_set(&self->fan, cosine, sine, (size_t)p->rays);
  return 0;
}
