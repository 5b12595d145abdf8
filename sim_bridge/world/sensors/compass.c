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
  if (compass_is_disturbed(p)) {
    double x, y;
    compass_field(p, from, current, &x, &y);
    heading = number_atan2(-y, x);
  }
  return compass_of(p, heading, p->sigma > 0.0 ? noise_next_normal(noise) : 0.0);
}
