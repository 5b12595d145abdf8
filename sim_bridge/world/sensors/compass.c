/* compass.c: see compass.h. */
#include "compass.h"

#include <math.h>

#include "geometry/numbers.h"

int compass_check(const compass_parameters *p) {
  const double sum = p->sigma + p->bias + p->iron_x + p->iron_y + p->current_x + p->current_y;
  return isfinite(sum) && p->sigma >= 0.0 && fabs(p->bias) <= 2.0 * NUMBERS_PI ? 0 : -1;
}

void compass_field(const compass_parameters *p, const viewpoint *from, double current, double *x, double *y) {
  *x = from->cosine + p->iron_x + p->current_x * current;
  *y = -from->sine + p->iron_y + p->current_y * current;
}

double compass_read(const compass_parameters *p, const viewpoint *from, double current, noise_source *noise) {
  double heading = from->heading;
  if (p->iron_x != 0.0 || p->iron_y != 0.0 || p->current_x != 0.0 || p->current_y != 0.0) {
    double x, y;
    compass_field(p, from, current, &x, &y);
    heading = number_atan2(-y, x);
  }
  const double draw = p->sigma > 0.0 ? noise_next_normal(noise) : 0.0;
  return number_wrap(heading + p->bias + p->sigma * draw);
}

/* ---- of a robot without a board ----------------------------------------------------------------------------------- */

static size_t make(void *self, const void *parameters) {
  *(compass_parameters *)self = *(const compass_parameters *)parameters;
  return compass_check(self) == 0;
}

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  const compass_parameters *p = self;
  const double current = p->current_x != 0.0 || p->current_y != 0.0 ? s->motor_current(s->robot) : 0.0;
  *readings = compass_read(p, &s->from, current, noise);
}

static const sensor_kind KIND = {.noise = 5, .size = sizeof(compass_parameters), .make = make, .read = read};
const sensor_kind *const compass_sensor = &KIND;
