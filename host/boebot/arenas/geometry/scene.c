/* scene.c: see scene.h. */
#include "scene.h"

#include <math.h>

#include "numbers.h"
#include "rays.h"

/* The normal of an edge (ex, ey), turned against a ray of direction (c, s). */
static void edge_normal(double ex, double ey, double c, double s, double *nx, double *ny) {
  const double length = sqrt(ex * ex + ey * ey);
  const double sign = ey * c - ex * s > 0.0 ? -1.0 : 1.0;
  *nx = sign * ey / length;
  *ny = -sign * ex / length;
}

/* The ray in the mover's frame against its outline. */
static double outline_ray(const mover *self, double dx, double dy, double c, double s, double reach, ray_hit *hit) {
  const ray r = {
      .x = dx * self->cosine + dy * self->sine,
      .y = dy * self->cosine - dx * self->sine,
      .cosine = c * self->cosine + s * self->sine,
      .sine = s * self->cosine - c * self->sine,
  };
  double best = reach;
  double ex = 0.0;
  double ey = 0.0;
  for (size_t i = 0; i < self->corners; i++) {
    const double *from = &self->outline[2 * i];
    const double *to = &self->outline[i + 1 < self->corners ? 2 * i + 2 : 0];
    arena_edge edge = {.ax = from[0], .ay = from[1], .ex = to[0] - from[0], .ey = to[1] - from[1]};
    edge.length_squared = edge.ex * edge.ex + edge.ey * edge.ey;
    const double d = ray_edge(&edge, &r, best);
    if (d < best) {
      best = d;
      ex = edge.ex;
      ey = edge.ey;
    }
  }
  if (!(best < reach)) return RAY_MISS;
  if (hit != NULL) {
    double nx, ny;
    edge_normal(ex, ey, r.cosine, r.sine, &nx, &ny);
    hit->normal_x = nx * self->cosine - ny * self->sine;
    hit->normal_y = nx * self->sine + ny * self->cosine;
  }
  return best;
}

/* The normal of a circle where the ray meets it. (dx, dy) leads from the centre to the ray's origin. */
static void circle_normal(double dx, double dy, double c, double s, double distance, ray_hit *hit) {
  double nx = dx + distance * c;
  double ny = dy + distance * s;
  const double length = sqrt(nx * nx + ny * ny);
  const double sign = nx * c + ny * s > 0.0 ? -1.0 : 1.0; /* met from inside */
  hit->normal_x = length > 0.0 ? sign * nx / length : -c;
  hit->normal_y = length > 0.0 ? sign * ny / length : -s;
}

double mover_ray(const mover *self, double x, double y, double c, double s, double reach, ray_hit *hit) {
  const double dx = x - self->x;
  const double dy = y - self->y;
  const double circle = ray_circle(-dx, -dy, self->radius, c, s);
  double d = circle;
  if (self->outline != NULL) {
    const int inside = dx * dx + dy * dy <= self->radius * self->radius;
    if (!inside && !(circle < reach)) return -1.0;
    d = outline_ray(self, dx, dy, c, s, reach, hit);
  } else if (d < reach && hit != NULL) {
    circle_normal(dx, dy, c, s, d, hit);
  }
  if (!(d < reach)) return -1.0;
  if (hit != NULL) {
    hit->distance = d;
    hit->infrared = self->infrared_reflectance;
    hit->sound = self->sound_reflectance;
  }
  return d;
}

/* What is known of an item of the arena that a ray has met. */
static void describe(const arena *where, uint32_t item, double x, double y, double c, double s, ray_hit *hit) {
  const size_t edges = arena_edge_count(where);
  if (item < edges) {
    const arena_edge *e = &arena_edges(where)[item];
    edge_normal(e->ex, e->ey, c, s, &hit->normal_x, &hit->normal_y);
    hit->shape = e->shape;
  } else {
    const arena_disc *d = &arena_discs(where)[item - edges];
    circle_normal(x - d->x, y - d->y, c, s, hit->distance, hit);
    hit->shape = d->shape;
  }
  const arena_surface *surface = &arena_shape_at(where, (size_t)hit->shape)->surface;
  hit->infrared = surface->infrared_reflectance;
  hit->sound = surface->sound_reflectance;
}

double scene_ray(const scene *self, double x, double y, double c, double s, double reach, double height,
                 uint32_t self_id, ray_hit *hit) {
  uint32_t item = 0;
  double best = arena_ray(self->arena, x, y, c, s, reach, height, &item);
  if (best >= 0.0 && hit != NULL) {
    hit->distance = best;
    describe(self->arena, item, x, y, c, s, hit);
  }
  for (size_t i = 0; i < self->movers_count; i++) {
    const mover *m = &self->movers[i];
    if ((self_id != 0 && m->id == self_id) || !(m->height >= height)) continue;
    const double d = mover_ray(m, x, y, c, s, best < 0.0 ? reach : best, hit);
    if (d < 0.0) continue;
    best = d;
    if (hit != NULL) hit->shape = -1 - (int)i;
  }
  return best;
}

void scene_fan(const scene *self, const fan_question *q, uint32_t self_id) {
  arena_fan(q);
  for (size_t k = 0; k < self->movers_count; k++) {
    const mover *m = &self->movers[k];
    if ((self_id != 0 && m->id == self_id) || !(m->height >= q->height)) continue;
    for (size_t i = 0; i < q->rays->rays; i++) {
      const double best = q->distances[i];
      const double c = q->cosine * q->rays->cosine[i] - q->sine * q->rays->sine[i];
      const double s = q->sine * q->rays->cosine[i] + q->cosine * q->rays->sine[i];
      const double d = mover_ray(m, q->x, q->y, c, s, best < 0.0 ? q->reach : best, NULL);
      if (d >= 0.0) q->distances[i] = d;
    }
  }
}

void scene_moving(const arena *where, double time, double dt, uint32_t first_id, mover *out) {
  const arena_moving *moving = arena_movings(where);
  for (size_t i = 0; i < arena_moving_count(where); i++) {
    path_state at, next;
    const double waited = out[i].waited;
    path_at(&moving[i].path, time - waited, &at);
    path_at(&moving[i].path, time - waited + dt, &next);
    out[i] = (mover){
        .x = at.x + out[i].shift_x,
        .y = at.y + out[i].shift_y,
        .vx = (next.x - at.x) / dt, /* over waypoints as well: no jump at the step's end */
        .vy = (next.y - at.y) / dt,
        .turn_rate = number_wrap(next.heading - at.heading) / dt, /* a loop may begin again at another count of turns */
        .radius = moving[i].radius,
        .outline = moving[i].outline,
        .corners = moving[i].corners,
        .height = moving[i].surface.height,
        .infrared_reflectance = moving[i].surface.infrared_reflectance,
        .sound_reflectance = moving[i].surface.sound_reflectance,
        .id = first_id + (uint32_t)i,
        .waited = waited,
        .waits = out[i].waits,
        .stops = out[i].stops,
        .shift_x = out[i].shift_x,
        .shift_y = out[i].shift_y,
        .shift_heading = out[i].shift_heading,
    };
    number_sincos(at.heading + out[i].shift_heading, &out[i].sine, &out[i].cosine);
  }
}

double mover_distance(const mover *self, double x, double y) {
  const double dx = x - self->x;
  const double dy = y - self->y;
  const double centre = sqrt(dx * dx + dy * dy);
  if (self->outline == NULL) return centre > self->radius ? centre - self->radius : 0.0;
  const double px = dx * self->cosine + dy * self->sine;
  const double py = dy * self->cosine - dx * self->sine;
  double best = 1e300;
  int inside = 0;
  for (size_t i = 0; i < self->corners; i++) {
    const double *a = &self->outline[2 * i];
    const double *b = &self->outline[i + 1 < self->corners ? 2 * i + 2 : 0];
    arena_edge edge = {.ax = a[0], .ay = a[1], .ex = b[0] - a[0], .ey = b[1] - a[1]};
    edge.length_squared = edge.ex * edge.ex + edge.ey * edge.ey;
    double qx, qy;
    const double d = arena_edge_distance_squared(&edge, px, py, &qx, &qy);
    if (d < best) best = d;
    if ((a[1] > py) != (b[1] > py) && px < a[0] + edge.ex * ((py - a[1]) / edge.ey)) inside = !inside;
  }
  return inside ? 0.0 : sqrt(best);
}

int scene_is_free(const scene *self, double x, double y, double radius, uint32_t self_id) {
  if (!arena_is_free(self->arena, x, y, radius)) return 0;
  for (size_t i = 0; i < self->movers_count; i++) {
    const mover *m = &self->movers[i];
    if (self_id != 0 && m->id == self_id) continue;
    const double apart = mover_distance(m, x, y);
    if (!(apart > 0.0 && apart >= radius)) return 0; /* inside of it is not free for a point either */
  }
  return 1;
}
