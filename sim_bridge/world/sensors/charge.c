/* charge.c: see charge.h. */
#include "charge.h"

static size_t make(void *self, const void *parameters) {
  const charge_parameters *p = parameters;
  *(charge_parameters *)self = *p;
  return 1;
}

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  const charge_parameters *p = self;
  const double noisy = p->sigma > 0.0 ? p->sigma * noise_next_normal(noise) : 0.0;
  *readings = p->empty + s->energy * (p->full - p->empty) + noisy;
}

static const sensor_kind KIND = {.noise = 11, .size = sizeof(charge_parameters), .make = make, .read = read};
const sensor_kind *const charge_sensor = &KIND;
