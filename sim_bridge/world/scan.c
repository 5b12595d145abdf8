/* scan.c: see scan.h.
 *
 * In the sensor's frame, turned so that the fan's middle lies on the x axis, an edge from a with direction e meets the
 * beam (c, s) at the distance K / (e_y c - e_x s) with K = a_x e_y - a_y e_x, from (3.6). The beams keep the reciprocal
 * of the least distance: it is linear in c and s, needs no division, and the largest one wins.
 */
#include "scan.h"

#include <math.h>
#include <stdlib.h>

#include "arena_data.h"
#include "numbers.h"
#include "rays.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#define BEARING_ERROR 2e-5 /* rad: what bearing() may err, and some more */
#define GRAZING 1e-9       /* m: edges whose line passes the sensor so closely are asked beam by beam */

struct scan_fan {
  size_t count;
  double turn_cosine, turn_sine; /* from the sensor's x axis to the fan's middle */
  double half;                   /* of the angle that the fan covers */
  double per_radian;             /* beams */
  double margin;                 /* beams */
  double *cosine, *sine;         /* of each beam, from the fan's middle */
  double *inverse;               /* 1 / distance found so far */
};

scan_fan *scan_fan_new(double first, double last, size_t count) {
  if (count < 2 || count > (1u << 20) || !(first < last) || !(last - first <= 2.0 * NUMBERS_PI + 1e-9)) return NULL;
  if (!(fabs(first) < 1e4)) return NULL;
  scan_fan *self = calloc(1, sizeof *self);
  double *values = malloc(3 * count * sizeof *values);
  if (self == NULL || values == NULL) {
    free(self);
    free(values);
    return NULL;
  }
  self->count = count;
  self->cosine = values;
  self->sine = values + count;
  self->inverse = values + 2 * count;
  self->half = 0.5 * (last - first);
  self->per_radian = (double)(count - 1) / (last - first);
  self->margin = BEARING_ERROR * self->per_radian + 1e-6;
  number_sincos(first + self->half, &self->turn_sine, &self->turn_cosine);
  for (size_t i = 0; i < count; i++) {
    number_sincos((double)i / self->per_radian - self->half, &self->sine[i], &self->cosine[i]);
  }
  return self;
}

void scan_fan_destroy(scan_fan *self) {
  if (self == NULL) return;
  free(self->cosine);
  free(self);
}

size_t scan_fan_count(const scan_fan *self) { return self->count; }

/* Direction of (x, y) in (-pi, pi], to 1e-5: Abramowitz and Stegun, 4.4.49 on the smaller of both ratios. */
static double bearing(double x, double y) {
  const double ax = fabs(x);
  const double ay = fabs(y);
  const double larger = ax > ay ? ax : ay;
  const double ratio = larger > 0.0 ? (ax > ay ? ay : ax) / larger : 0.0;
  const double z = ratio * ratio;
  double angle = ratio * (0.9998660 + z * (-0.3302995 + z * (0.1801410 + z * (-0.0851330 + z * 0.0208351))));
  angle = ax > ay ? angle : 0.5 * NUMBERS_PI - angle;
  angle = x < 0.0 ? NUMBERS_PI - angle : angle;
  return copysign(angle, y);
}

static void keep(scan_fan *self, long i, double distance) {
  const double inverse = 1.0 / distance;
  if (inverse > self->inverse[i]) self->inverse[i] = inverse;
}

/* Beam numbers from the smallest >= low to the largest <= high that the fan has. */
static void beams_within(const scan_fan *self, double low, double high, long *first, long *last) {
  const double most = (double)(self->count - 1);
  *first = low <= 0.0 ? 0 : (low > most ? (long)self->count : (long)low + ((double)(long)low < low));
  *last = high >= most ? (long)self->count - 1 : (high < 0.0 ? -1 : (long)high);
}

/* Where an edge's line lies nearest in beams `first` to `last`: the greatest of a c + b s. */
static void sweep(scan_fan *self, long first, long last, double a, double b) {
  const double *c = self->cosine;
  const double *s = self->sine;
  double *inverse = self->inverse;
  long i = first;
#ifdef __SSE2__
  const __m128d aa = _mm_set1_pd(a);
  const __m128d bb = _mm_set1_pd(b);
  for (; i < last; i += 2) {
    const __m128d value = _mm_add_pd(_mm_mul_pd(aa, _mm_loadu_pd(c + i)), _mm_mul_pd(bb, _mm_loadu_pd(s + i)));
    _mm_storeu_pd(inverse + i, _mm_max_pd(value, _mm_loadu_pd(inverse + i)));
  }
#endif
  for (; i <= last; i++) {
    const double value = a * c[i] + b * s[i];
    if (value > inverse[i]) inverse[i] = value;
  }
}

static void ask_edge(scan_fan *self, const arena_edge *e, long first, long last) {
  for (long i = first; i <= last; i++) {
    const ray beam = {0.0, 0.0, self->cosine[i], self->sine[i]};
    const double d = ray_edge(e, &beam, RAY_MISS);
    if (d < RAY_MISS) keep(self, i, d);
  }
}

/* An edge between the bearings low < high, less than pi apart. */
static void cover(scan_fan *self, const arena_edge *e, double k, double low, double high) {
  const double from = (low + self->half) * self->per_radian;
  const double to = (high + self->half) * self->per_radian;
  const double margin = self->margin;
  if (to + margin < 0.0 || from - margin > (double)(self->count - 1)) return;
  long outer_first, outer_last, first, last;
  beams_within(self, from - margin, to + margin, &outer_first, &outer_last);
  beams_within(self, from + margin, to - margin, &first, &last);
  if (first > last || k * k <= GRAZING * GRAZING * e->length_squared) {
    ask_edge(self, e, outer_first, outer_last);
    return;
  }
  ask_edge(self, e, outer_first, first - 1);
  sweep(self, first, last, e->ey / k, -e->ex / k);
  ask_edge(self, e, last + 1, outer_last);
}

/* An edge of which the ends' bearings are known. Behind the fan's middle it may go across pi. */
static void see_edge(scan_fan *self, const arena_edge *e, double k, double bearing_a, double bearing_b) {
  const double low = bearing_a < bearing_b ? bearing_a : bearing_b;
  const double high = bearing_a < bearing_b ? bearing_b : bearing_a;
  const double angle = high - low;
  if (fabs(angle - NUMBERS_PI) < 1e-3 || k == 0.0) { /* the sensor sits almost on the edge, or in line with it */
    ask_edge(self, e, 0, (long)self->count - 1);
  } else if (angle < NUMBERS_PI) {
    cover(self, e, k, low, high);
  } else {
    cover(self, e, k, high, NUMBERS_PI + BEARING_ERROR);
    cover(self, e, k, -NUMBERS_PI - BEARING_ERROR, low);
  }
}

/* Corners in a row, every `stride` numbers, in a frame in which the sensor is at (x, y), looking to (c, s). */
typedef struct {
  const double *xy;
  size_t stride, count;
  const double *end; /* where the last edge leads */
  int closed;
  double x, y, c, s;
} outline;

static void corner_of(const outline *o, const double *xy, double *x, double *y) {
  const double dx = xy[0] - o->x;
  const double dy = xy[1] - o->y;
  *x = dx * o->c + dy * o->s;
  *y = dy * o->c - dx * o->s;
}

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

static void see_outline(scan_fan *self, const outline *o, double reach) {
  const int side = visible_side(o);
  double ax, ay;
  double bearing_a = 0.0;
  int known = 0;
  corner_of(o, o->xy, &ax, &ay);
  for (size_t i = 1; i <= o->count; i++) {
    double bx, by;
    corner_of(o, i < o->count ? &o->xy[i * o->stride] : o->end, &bx, &by);
    arena_edge e = {.ax = ax, .ay = ay, .ex = bx - ax, .ey = by - ay};
    const double k = ax * e.ey - ay * e.ex;
    e.length_squared = e.ex * e.ex + e.ey * e.ey;
    const int hidden = (side > 0 && k < 0.0) || (side < 0 && k > 0.0) || k * k > reach * reach * e.length_squared;
    if (hidden) {
      known = 0;
    } else {
      if (!known) bearing_a = bearing(ax, ay);
      const double bearing_b = bearing(bx, by);
      see_edge(self, &e, k, bearing_a, bearing_b);
      bearing_a = bearing_b;
      known = 1;
    }
    ax = bx;
    ay = by;
  }
}

/* A circle around (dx, dy). */
static void see_circle(scan_fan *self, double dx, double dy, double radius) {
  const double square = dx * dx + dy * dy;
  double low = -NUMBERS_PI;
  double high = NUMBERS_PI;
  if (square > radius * radius * (1.0 + 1e-9)) {
    const double middle = bearing(dx, dy);
    const double half = bearing(sqrt(square - radius * radius), radius);
    low = middle - half;
    high = middle + half;
  }
  for (int round = -1; round <= 1; round++) { /* the circle may reach across pi */
    const double shift = round * 2.0 * NUMBERS_PI + self->half;
    long first, last;
    beams_within(self, (low + shift) * self->per_radian - 2.0 * self->margin,
                 (high + shift) * self->per_radian + 2.0 * self->margin, &first, &last);
    for (long i = first; i <= last; i++) {
      const double d = ray_circle(dx, dy, radius, self->cosine[i], self->sine[i]);
      if (d < RAY_MISS) keep(self, i, d);
    }
  }
}

static void see_arena(scan_fan *self, const arena *where, const outline *sensor, double reach, double height) {
  for (size_t i = 0; i < where->shape_count; i++) {
    const arena_shape *shape = &where->shape[i];
    if (!(shape->surface.height >= height)) continue;
    const double dx = shape->x - sensor->x;
    const double dy = shape->y - sensor->y;
    const double far = reach + shape->radius;
    if (dx * dx + dy * dy > far * far) continue;
    outline o = *sensor;
    if (shape->kind == ARENA_DISC) {
      const arena_disc *d = &where->disc[shape->first];
      double x, y;
      corner_of(sensor, (const double[]){d->x, d->y}, &x, &y);
      see_circle(self, x, y, d->radius);
      continue;
    }
    const arena_edge *edges = &where->edge[shape->first];
    const arena_edge *last = &edges[shape->count - 1];
    const double end[2] = {last->ax + last->ex, last->ay + last->ey};
    o.xy = &edges->ax;
    o.stride = sizeof(arena_edge) / sizeof(double);
    o.count = shape->count;
    o.closed = shape->kind != ARENA_WALL;
    o.end = o.closed ? o.xy : end;
    see_outline(self, &o, reach);
  }
}

static void see_mover(scan_fan *self, const mover *m, const outline *sensor, double reach) {
  const double dx = sensor->x - m->x;
  const double dy = sensor->y - m->y;
  const double far = reach + m->radius;
  if (dx * dx + dy * dy > far * far) return;
  if (m->outline == NULL) {
    double x, y;
    corner_of(sensor, (const double[]){m->x, m->y}, &x, &y);
    see_circle(self, x, y, m->radius);
    return;
  }
  const outline o = {
      .xy = m->outline,
      .stride = 2,
      .count = m->corners,
      .end = m->outline,
      .closed = 1,
      .x = dx * m->cosine + dy * m->sine,
      .y = dy * m->cosine - dx * m->sine,
      .c = sensor->c * m->cosine + sensor->s * m->sine,
      .s = sensor->s * m->cosine - sensor->c * m->sine,
  };
  see_outline(self, &o, reach);
}

void scan_look(scan_fan *self, const scene *around, double x, double y, double cosine, double sine, double reach,
               double height, uint32_t self_id, double *distances) {
  const double limit = reach < 1e9 ? reach : 1e9;
  const double length = cosine * cosine + sine * sine;
  if (!(reach > 0.0) || !(x * x + y * y < 1e18) || !(length > 0.5 && length < 2.0)) {
    for (size_t i = 0; i < self->count; i++) distances[i] = -1.0;
    return;
  }
  const double nothing = 1.0 / limit;
  const outline sensor = {
      .x = x,
      .y = y,
      .c = cosine * self->turn_cosine - sine * self->turn_sine,
      .s = sine * self->turn_cosine + cosine * self->turn_sine,
  };
  for (size_t i = 0; i < self->count; i++) self->inverse[i] = nothing;
  see_arena(self, around->arena, &sensor, limit, height);
  for (size_t i = 0; i < around->movers_count; i++) {
    const mover *m = &around->movers[i];
    if ((self_id != 0 && m->id == self_id) || !(m->height >= height)) continue;
    see_mover(self, m, &sensor, limit);
  }
  for (size_t i = 0; i < self->count; i++) distances[i] = self->inverse[i] > nothing ? 1.0 / self->inverse[i] : -1.0;
}
