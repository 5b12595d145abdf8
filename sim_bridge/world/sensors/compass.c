/* compass.c: see compass.h. */
#include "compass.h"

#include "geometry/numbers.h"

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

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  const compass_parameters *p = self;
  const double current = p->current_x != 0.0 || p->current_y != 0.0 ? s->motor_current(s->robot) : 0.0;
  *readings = compass_read(p, &s->from, current, noise);
}

const sensor_kind compass_sensor = {.noise = 5, .size = sizeof(compass_parameters), .readings = 1, .read = read};
