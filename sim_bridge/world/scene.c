/* scene.c: see scene.h. */
#include "scene.h"

#include <math.h>

/* The normal of an edge (ex, ey), turned against a ray of direction (c, s). */
static void edge_normal(double ex, double ey, double c, double s, double *nx, double *ny) {
  const double length = sqrt(ex * ex + ey * ey);
  const double sign = ey * c - ex * s > 0.0 ? -1.0 : 1.0;
  *nx = sign * ey / length;
  *ny = -sign * ex / length;
}

/* The ray in the mover's frame against its outline. */
static double outline_ray(const mover *self, double dx, double dy, double c, double s, double reach, ray_hit *hit) {
  const double x = dx * self->cosine + dy * self->sine;
  const double y = dy * self->cosine - dx * self->sine;
  const double along_x = c * self->cosine + s * self->sine;
  const double along_y = s * self->cosine - c * self->sine;
  double best = reach;
  double ex = 0.0;
  double ey = 0.0;
  for (size_t i = 0; i < self->corners; i++) {
    const double *from = &self->outline[2 * i];
    const double *to = &self->outline[i + 1 < self->corners ? 2 * i + 2 : 0];
    arena_edge edge = {.ax = from[0], .ay = from[1], .ex = to[0] - from[0], .ey = to[1] - from[1]};
    edge.length_squared = edge.ex * edge.ex + edge.ey * edge.ey;
    const double d = arena_edge_ray(&edge, x, y, along_x, along_y, best);
    if (d < best) {
      best = d;
      ex = edge.ex;
      ey = edge.ey;
    }
  }
  if (!(best < reach)) return -1.0;
  if (hit != NULL) {
    double nx, ny;
    edge_normal(ex, ey, along_x, along_y, &nx, &ny);
    hit->normal_x = nx * self->cosine - ny * self->sine;
    hit->normal_y = nx * self->sine + ny * self->cosine;
  }
  return best;
}

double mover_ray(const mover *self, double x, double y, double c, double s, double reach, ray_hit *hit) {
  const double dx = x - self->x;
  const double dy = y - self->y;
  const double along = -(dx * c + dy * s);
  const double beside = dx * s - dy * c;
  const double inside = self->radius * self->radius - beside * beside;
  if (!(inside >= 0.0)) return -1.0; /* past the circle */
  const double half = sqrt(inside);
  if (along + half < 0.0 || along - half > reach) return -1.0;
  double d = along - half >= 0.0 ? along - half : along + half;
  if (self->outline != NULL) {
    d = outline_ray(self, dx, dy, c, s, reach, hit);
  } else if (d < reach && hit != NULL) {
    const double side = along - half >= 0.0 ? 1.0 : -1.0;
    hit->normal_x = self->radius > 0.0 ? side * (dx + d * c) / self->radius : -c;
    hit->normal_y = self->radius > 0.0 ? side * (dy + d * s) / self->radius : -s;
  }
  if (!(d >= 0.0 && d < reach)) return -1.0;
  if (hit != NULL) {
    hit->distance = d;
    hit->infrared = self->infrared_reflectance;
    hit->sound = self->sound_reflectance;
  }
  return d;
}

double scene_ray(const scene *self, double x, double y, double c, double s, double reach, double height,
                 uint32_t self_id, ray_hit *hit) {
  size_t edge = 0;
  double best = arena_ray(self->arena, x, y, c, s, reach, &edge);
  if (best >= 0.0 && hit != NULL) {
    const arena_edge *e = &arena_edges(self->arena)[edge];
    *hit = (ray_hit){.distance = best, .infrared = 1.0, .sound = 1.0, .shape = e->polygon};
    edge_normal(e->ex, e->ey, c, s, &hit->normal_x, &hit->normal_y);
  }
  for (size_t i = 0; i < self->movers_count; i++) {
    const mover *m = &self->movers[i];
    if ((self_id != 0 && m->id == self_id) || m->height < height) continue;
    const double d = mover_ray(m, x, y, c, s, best < 0.0 ? reach : best, hit);
    if (d < 0.0) continue;
    best = d;
    if (hit != NULL) hit->shape = -1 - (int)i;
  }
  return best;
}
