/* charge.c: see charge.h. */
#include "charge.h"

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  const charge_parameters *p = self;
  const double noisy = p->sigma > 0.0 ? p->sigma * noise_next_normal(noise) : 0.0;
  *readings = p->empty + s->energy * (p->full - p->empty) + noisy;
}

const sensor_kind charge_sensor = {.noise = 11, .size = sizeof(charge_parameters), .readings = 1, .read = read};
