/* rays.h: one ray against one item, after (3.4)-(3.8) of the notes; for the files that ask many items.
 *
 * The distance to an item is a function of ray and item alone, and the nearest of equally near items is the one with the
 * smallest number: so the answer does not depend on the order in which items are asked, nor on an index.
 */
#ifndef GEOMETRY_RAYS_H
#define GEOMETRY_RAYS_H

#include <math.h>
#include <stdint.h>

#include "items.h"

#define RAY_CRACK 1e-12 /* no ray passes a shared vertex: edges are longer by this share */
#define RAY_MISS 1e300

typedef struct {
  double x, y, cosine, sine;
} ray;

/* Rays along an edge, for ray_edge: the nearer of what lies ahead of the ray. */
static inline double ray_along_edge(const arena_edge *e, const ray *r, double u) {
  if (u * u > 1e-24) return RAY_MISS; /* parallel beside it */
  const double a = (e->ax - r->x) * r->cosine + (e->ay - r->y) * r->sine;
  const double b = a + e->ex * r->cosine + e->ey * r->sine;
  if ((a < 0.0) != (b < 0.0)) return 0.0; /* the ray starts on the edge */
  if (a < 0.0) return RAY_MISS;
  return a < b ? a : b;
}

/* Distance to the edge. RAY_MISS where it is not met, or surely not nearer than `best`. Surfaces have two sides. */
static inline double ray_edge(const arena_edge *e, const ray *r, double best) {
  const double wx = r->x - e->ax;
  const double wy = r->y - e->ay;
  const double signed_den = e->ey * r->cosine - e->ex * r->sine;
  const double sign = copysign(1.0, signed_den);
  const double den = fabs(signed_den);
  const double t = sign * (e->ex * wy - e->ey * wx);       /* numerator of (3.6) */
  const double u = sign * (r->cosine * wy - r->sine * wx); /* numerator of (3.7) */
  if (!(den * den > 1e-24 * e->length_squared)) return ray_along_edge(e, r, u);
  const double slack = RAY_CRACK * den;
  /* Beside the edge, behind the ray, or farther than `best` by more than rounding can explain. */
  if ((t < 0.0) | (t > best * den * (1.0 + RAY_CRACK)) | (u < -slack) | (u > den + slack)) return RAY_MISS;
  return t / den;
}

/* Distance to a circle of `radius` whose centre lies at (dx, dy) from the ray's origin, met from outside or inside. */
static inline double ray_circle(double dx, double dy, double radius, double cosine, double sine) {
  const double along = dx * cosine + dy * sine;
  const double beside = dx * sine - dy * cosine;
  const double square = radius * radius - beside * beside;
  if (!(square >= 0.0)) return RAY_MISS;
  const double half = sqrt(square);
  if (along >= half) return along - half;
  return along + half >= 0.0 ? along + half : RAY_MISS;
}

static inline double ray_disc(const arena_disc *d, const ray *r) {
  return ray_circle(d->x - r->x, d->y - r->y, d->radius, r->cosine, r->sine);
}

typedef struct {
  double distance; /* of the nearest so far, or the reach */
  uint32_t item;
} ray_nearest;

static inline void ray_take(ray_nearest *nearest, double distance, uint32_t item) {
  if (distance < nearest->distance || (distance == nearest->distance && item < nearest->item)) {
    nearest->distance = distance;
    nearest->item = item;
  }
}

#endif
