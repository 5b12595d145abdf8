/* outline.c: see outline.h. */
#include "outline.h"

#include <math.h>
#include <string.h>

#include "geometry/arena.h"

#define ROUNDING 1e-3
#define ROUNDING_NARROW 1e-4 /* m: a narrow place needs no less */
#define CORNER_LOSS 1e-4     /* m: a corner's tip is at most so far outside of what is rounded */

static double cross(const double *o, const double *a, const double *b) {
  return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
}

static double area_of(const double *xy, size_t n) {
  double twice = 0.0;
  for (size_t i = 0; i < n; i++) {
    const double *a = xy + 2 * i;
    const double *b = xy + 2 * ((i + 1) % n);
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return 0.5 * twice;
}

/* Moves every edge inwards by `by`; a corner goes to where its edges then meet. Returns 1 if every edge kept its direction
 * and the result is simple. */
static int shrink(const double *xy, size_t n, double by, double *core) {
  for (size_t i = 0; i < n; i++) {
    const double *a = xy + 2 * ((i + n - 1) % n);
    const double *b = xy + 2 * i;
    const double *c = xy + 2 * ((i + 1) % n);
    const double l1 = sqrt((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]));
    const double l2 = sqrt((c[0] - b[0]) * (c[0] - b[0]) + (c[1] - b[1]) * (c[1] - b[1]));
    const double n1x = -(b[1] - a[1]) / l1;
    const double n1y = (b[0] - a[0]) / l1;
    const double n2x = -(c[1] - b[1]) / l2;
    const double n2y = (c[0] - b[0]) / l2;
    const double along = 1.0 + n1x * n2x + n1y * n2y;
    if (along < 1e-9) return 0;
    core[2 * i] = b[0] + by * (n1x + n2x) / along;
    core[2 * i + 1] = b[1] + by * (n1y + n2y) / along;
  }
  for (size_t i = 0; i < n; i++) {
    const size_t k = (i + 1) % n;
    const double along = (core[2 * k] - core[2 * i]) * (xy[2 * k] - xy[2 * i]) +
                         (core[2 * k + 1] - core[2 * i + 1]) * (xy[2 * k + 1] - xy[2 * i + 1]);
    if (!(along > 0.0)) return 0;
  }
  uint32_t one, other;
  return arena_crossing(core, n, &one, &other) == 0;
}

/* The rounding r with which no outward corner of angle a loses more than CORNER_LOSS: r (1 / sin(a/2) - 1), the distance
 * of its tip from the circle of radius r that touches both edges. */
static double rounding_of(const double *xy, size_t n) {
  double rounding = ROUNDING;
  for (size_t i = 0; i < n; i++) {
    const double *a = xy + 2 * ((i + n - 1) % n);
    const double *b = xy + 2 * i;
    const double *c = xy + 2 * ((i + 1) % n);
    if (!(cross(a, b, c) > 0.0)) continue;
    const double ux = a[0] - b[0], uy = a[1] - b[1];
    const double wx = c[0] - b[0], wy = c[1] - b[1];
    const double cosine = (ux * wx + uy * wy) / sqrt((ux * ux + uy * uy) * (wx * wx + wy * wy));
    const double half = sqrt(fmax(0.5 * (1.0 - cosine), 0.0)); /* sin(a/2) */
    if (rounding * (1.0 - half) > CORNER_LOSS * half) rounding = CORNER_LOSS * half / (1.0 - half);
  }
  return rounding;
}

int body_outline_make(body_outline *self, const double *xy, size_t corners) {
  memset(self, 0, sizeof *self);
  const int turned = area_of(xy, corners) < 0.0;
  for (size_t i = 0; i < corners; i++) {
    const size_t from = turned ? corners - 1 - i : i;
    self->xy[2 * i] = xy[2 * from];
    self->xy[2 * i + 1] = xy[2 * from + 1];
    const double reach = sqrt(xy[2 * i] * xy[2 * i] + xy[2 * i + 1] * xy[2 * i + 1]);
    if (reach > self->reach) self->reach = reach;
  }
  const double most = rounding_of(self->xy, corners);
  for (double by = most; by >= fmin(most, ROUNDING_NARROW); by *= 0.5) {
    /* shrunk twice as far it must still be itself: so that the core has a width */
    if (!shrink(self->xy, corners, 2.0 * by, self->core) || !shrink(self->xy, corners, by, self->core)) continue;
    self->rounding = by;
    self->corners = corners;
    return OUTLINE_OK;
  }
  return OUTLINE_THIN;
}
