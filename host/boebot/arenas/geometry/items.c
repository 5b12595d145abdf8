/* items.c: see items.h. Distances follow section 3.2.5 of the notes. */
#include "items.h"

#include <math.h>

double arena_edge_distance_squared(const arena_edge *e, double x, double y, double *qx, double *qy) {
  double along = ((x - e->ax) * e->ex + (y - e->ay) * e->ey) / e->length_squared;
  if (along < 0.0) along = 0.0;
  if (along > 1.0) along = 1.0;
  *qx = e->ax + along * e->ex;
  *qy = e->ay + along * e->ey;
  return (x - *qx) * (x - *qx) + (y - *qy) * (y - *qy);
}

double arena_disc_distance(const arena_disc *d, double x, double y, double *qx, double *qy) {
  const double dx = x - d->x;
  const double dy = y - d->y;
  const double distance = sqrt(dx * dx + dy * dy);
  const double share = distance > 0.0 ? d->radius / distance : 0.0;
  *qx = distance > 0.0 ? d->x + share * dx : d->x + d->radius; /* from its centre all points are equally near */
  *qy = d->y + share * dy;
  return distance - d->radius;
}

int arena_edge_meets_segment(const arena_edge *e, double x0, double y0, double x1, double y1) {
  const double dx = x1 - x0;
  const double dy = y1 - y0;
  const double wx = x0 - e->ax;
  const double wy = y0 - e->ay;
  double den = e->ey * dx - e->ex * dy; /* (3.6), (3.7) times the sign of den */
  double t = e->ex * wy - e->ey * wx;   /* along the segment */
  double u = dx * wy - dy * wx;         /* along the edge */
  if (den < 0.0) {
    den = -den;
    t = -t;
    u = -u;
  }
  if (den > 1e-12 * e->length_squared) return t >= 0.0 && t <= den && u >= 0.0 && u <= den;
  double qx, qy; /* parallel: they meet if an end of one lies on the other */
  if (arena_edge_distance_squared(e, x0, y0, &qx, &qy) <= 1e-24) return 1;
  if (arena_edge_distance_squared(e, x1, y1, &qx, &qy) <= 1e-24) return 1;
  const arena_edge other = {.ax = x0, .ay = y0, .ex = dx, .ey = dy, .length_squared = dx * dx + dy * dy};
  return other.length_squared > 0.0 && arena_edge_distance_squared(&other, e->ax, e->ay, &qx, &qy) <= 1e-24;
}

int arena_disc_meets_segment(const arena_disc *d, double x0, double y0, double x1, double y1) {
  const arena_edge segment = {
      .ax = x0,
      .ay = y0,
      .ex = x1 - x0,
      .ey = y1 - y0,
      .length_squared = (x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0),
  };
  double qx = x0;
  double qy = y0;
  if (segment.length_squared > 0.0) arena_edge_distance_squared(&segment, d->x, d->y, &qx, &qy);
  return (qx - d->x) * (qx - d->x) + (qy - d->y) * (qy - d->y) <= d->radius * d->radius;
}
