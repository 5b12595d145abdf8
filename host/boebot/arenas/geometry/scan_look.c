/* scan_look.c: see scan.h. What is before the fan: the arena's shapes and what moves. Edges are collected in blocks, which
 * scan_edges.c lets the fan see.
 */
#include "scan.h"

#include <math.h>
#include <stdlib.h>

#include "arena_data.h"
#include "numbers.h"
#include "scan_fan.h"

scan_fan *scan_fan_new(double first, double last, size_t count) {
  if (count < 2 || count > (1u << 20) || !(first < last) || !(last - first <= 2.0 * NUMBERS_PI + 1e-9)) return NULL;
  if (!(fabs(first) < 1e4)) return NULL;
  scan_fan *self = calloc(1, sizeof *self + 3 * count * sizeof *self->values);
  if (self == NULL) return NULL;
  self->count = count;
  self->cosine = self->values;
  self->sine = self->values + count;
  self->inverse = self->values + 2 * count;
  self->half = 0.5 * (last - first);
  self->per_radian = (double)(count - 1) / (last - first);
  self->margin = SCAN_BEARING_ERROR * self->per_radian + 1e-6;
  number_sincos(first + self->half, &self->turn_sine, &self->turn_cosine);
  for (size_t i = 0; i < count; i++) {
    number_sincos((double)i / self->per_radian - self->half, &self->sine[i], &self->cosine[i]);
  }
  return self;
}

void scan_fan_destroy(scan_fan *self) { free(self); }

/* Corners in a row, every `stride` numbers, and where the sensor is in their frame. */
typedef struct {
  const double *xy;
  size_t stride, count;
  const double *end; /* where the last edge leads */
  int closed;
  double x, y;
} outline;

/* Which side of a closed outline's edges can be seen: 1: where K > 0, -1: where K < 0; 0: both, if it is open, or the
 * sensor is so near that rounding might decide. From outside, only faces turned outwards come first; from inside, only
 * faces turned inwards. */
static int visible_side(const outline *o) {
  if (!o->closed) return 0;
  int inside = 0;
  double area = 0.0;
  double ax = o->xy[0] - o->x;
  double ay = o->xy[1] - o->y;
  for (size_t i = 1; i <= o->count; i++) {
    const double *to = i < o->count ? &o->xy[i * o->stride] : o->end;
    const double bx = to[0] - o->x;
    const double by = to[1] - o->y;
    const double k = ax * by - ay * bx;
    area += k;
    if ((ay > 0.0) != (by > 0.0)) {
      if (fabs(k) < 1e-9) return 0;
      inside ^= (k > 0.0) == (by > ay);
    }
    ax = bx;
    ay = by;
  }
  if (fabs(area) < 1e-9) return 0;
  /* Counter-clockwise, K > 0 on the inner side. */
  return (area > 0.0) == inside ? 1 : -1;
}

/* Shortens the reach as well, once each beam has met something. */
static void see_block(scan_fan *self, scan_edges *edges) {
  scan_see(self, edges);
  const double farthest = scan_farthest(self) * (1.0 + 1e-9);
  if (farthest < edges->reach) edges->reach = farthest;
}

static void see_outline(scan_fan *self, const outline *o, scan_edges *edges) {
  const int side = visible_side(o);
  double ax = o->xy[0] - o->x;
  double ay = o->xy[1] - o->y;
  size_t n = edges->count;
  for (size_t i = 1; i <= o->count; i++) {
    const double *to = i < o->count ? &o->xy[i * o->stride] : o->end;
    const double bx = to[0] - o->x;
    const double by = to[1] - o->y;
    edges->ax[n] = ax;
    edges->ay[n] = ay;
    edges->bx[n] = bx;
    edges->by[n] = by;
    n += side * (ax * by - ay * bx) >= 0.0;
    if (n == SCAN_BLOCK) {
      edges->count = n;
      see_block(self, edges);
      n = 0;
    }
    ax = bx;
    ay = by;
  }
  edges->count = n;
}

static void see_shape(scan_fan *self, const arena *where, const arena_shape *shape, double x, double y,
                      scan_edges *edges) {
  if (shape->kind == ARENA_DISC) {
    const arena_disc *d = &where->disc[shape->first];
    scan_see_circle(self, d->x - x, d->y - y, d->radius, edges);
    return;
  }
  const arena_edge *first = &where->edge[shape->first];
  const arena_edge *last = &first[shape->count - 1];
  const double end[2] = {last->ax + last->ex, last->ay + last->ey};
  const int closed = shape->kind != ARENA_WALL;
  const outline o = {.xy = &first->ax,
                     .stride = sizeof(arena_edge) / sizeof(double),
                     .count = shape->count,
                     .end = closed ? &first->ax : end,
                     .closed = closed,
                     .x = x,
                     .y = y};
  see_outline(self, &o, edges);
}

/* What is near comes first: it may make the reach so short that most of the rest is out of it. */
static void see_arena(scan_fan *self, const arena *where, double x, double y, double height, scan_edges *edges) {
  const double near = 0.25 * edges->reach;
  for (int round = 0; round < 2; round++) {
    for (size_t i = 0; i < where->shape_count; i++) {
      const arena_shape *shape = &where->shape[i];
      const double dx = shape->x - x;
      const double dy = shape->y - y;
      const double square = dx * dx + dy * dy;
      const double close = near + shape->radius;
      const double far = edges->reach + shape->radius;
      const int due = round == 0 ? square <= close * close : square > close * close && square <= far * far;
      if (due && shape->surface.height >= height) see_shape(self, where, shape, x, y, edges);
    }
  }
  scan_see(self, edges);
}

static void see_mover(scan_fan *self, const mover *m, double x, double y, const scan_edges *of_arena) {
  const double dx = x - m->x;
  const double dy = y - m->y;
  const double far = of_arena->reach + m->radius;
  if (dx * dx + dy * dy > far * far) return;
  if (m->outline == NULL) {
    scan_see_circle(self, -dx, -dy, m->radius, of_arena);
    return;
  }
  scan_edges edges;
  edges.count = 0;
  edges.reach = of_arena->reach;
  edges.c = of_arena->c * m->cosine + of_arena->s * m->sine;
  edges.s = of_arena->s * m->cosine - of_arena->c * m->sine;
  const outline o = {.xy = m->outline,
                     .stride = 2,
                     .count = m->corners,
                     .end = m->outline,
                     .closed = 1,
                     .x = dx * m->cosine + dy * m->sine,
                     .y = dy * m->cosine - dx * m->sine};
  see_outline(self, &o, &edges);
  scan_see(self, &edges);
}

void scan_look(scan_fan *self, const scene *around, double x, double y, double cosine, double sine, double reach,
               double height, uint32_t self_id, double *distances) {
  const double limit = reach < 1e9 ? reach : 1e9;
  const double length = cosine * cosine + sine * sine;
  if (!(reach > 0.0) || !(x * x + y * y < 1e18) || !(length > 0.5 && length < 2.0)) {
    for (size_t i = 0; i < self->count; i++) distances[i] = -1.0;
    return;
  }
  scan_edges edges;
  edges.count = 0;
  edges.reach = limit;
  edges.c = cosine * self->turn_cosine - sine * self->turn_sine;
  edges.s = sine * self->turn_cosine + cosine * self->turn_sine;
  see_arena(self, around->arena, x, y, height, &edges);
  for (size_t i = 0; i < around->movers_count; i++) {
    const mover *m = &around->movers[i];
    if ((self_id == 0 || m->id != self_id) && m->height >= height) see_mover(self, m, x, y, &edges);
  }
  scan_distances(self, 1.0 / limit, distances);
}
