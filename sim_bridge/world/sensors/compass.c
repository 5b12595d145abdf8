/* compass.c: see compass.h. */
#include "compass.h"

#include <math.h>

#include "../numbers.h"

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
  const int disturbed = p->iron_x != 0.0 || p->iron_y != 0.0 || p->current_x != 0.0 || p->current_y != 0.0;
  if (disturbed) {
    double x, y;
    compass_field(p, from, current, &x, &y);
    heading = number_atan2(-y, x);
  }
  const double noisy = p->sigma > 0.0 ? p->sigma * noise_next_normal(noise) : 0.0;
  return number_wrap(heading + p->bias + noisy);
}
