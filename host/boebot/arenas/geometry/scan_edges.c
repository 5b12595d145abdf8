/* scan_edges.c: edges before the fan of a laser range finder, see scan_look.c.
 *
 * In the sensor's frame, turned so that the fan's middle lies on the x axis, an edge from a with direction e meets the
 * beam (c, s) at the distance K / (e_y c - e_x s) with K = a_x e_y - a_y e_x, from (3.6). The beams keep the reciprocal
 * of the least distance: it is linear in c and s, needs no division, and the largest one wins. Loops over edges and beams
 * have no branches, so that the compiler can make vectors of them.
 */
#include "numbers.h"
#include "scan_fan.h"

#define GRAZING 1e-9 /* m: edges whose line passes the sensor so closely are asked beam by beam */
#define NEARLY_PI (NUMBERS_PI - 1e-3)

/* Kinds of edges; numbers as the others, for the same loop. */
#define UNSEEN 0.0
#define SWEPT 1.0
#define AWKWARD 2.0

/* What is known of each edge of a block in the fan's frame. */
typedef struct {
  double ax[SCAN_BLOCK], ay[SCAN_BLOCK], ex[SCAN_BLOCK], ey[SCAN_BLOCK];
  double a[SCAN_BLOCK], b[SCAN_BLOCK];                     /* 1 / distance = a c + b s */
  double low[SCAN_BLOCK], high[SCAN_BLOCK];                /* bearings of its ends */
  int32_t first[SCAN_BLOCK], last[SCAN_BLOCK];             /* beams that surely meet it */
  int32_t outer_first[SCAN_BLOCK], outer_last[SCAN_BLOCK]; /* beams that may meet it */
  double kind[SCAN_BLOCK];
} spans;

/* The larger and the smaller one; b where neither is. */
static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

/* To the nearest whole number below and above, |x| < 2^51: rounded by a sum, then corrected. */
static inline double below(double x) {
  const double whole = (x + 0x1.8p52) - 0x1.8p52;
  return whole > x ? whole - 1.0 : whole;
}
static inline double above(double x) {
  const double whole = (x + 0x1.8p52) - 0x1.8p52;
  return whole < x ? whole + 1.0 : whole;
}

/* Direction of (x, y) in [-pi, pi], to 1e-5: Abramowitz and Stegun, 4.4.49 on the smaller of both ratios. */
static inline double bearing(double x, double y) {
  const double ax = fabs(x);
  const double ay = fabs(y);
  const double ratio = smaller(ax, ay) / larger(larger(ax, ay), 0x1p-1000); /* 0 for (0, 0) */
  const double z = ratio * ratio;
  const double sum = 0.9998660 + z * (-0.3302995 + z * (0.1801410 + z * (-0.0851330 + z * 0.0208351)));
  const double steep = ax > ay ? ratio * sum : 0.5 * NUMBERS_PI - ratio * sum;
  return copysign(x < 0.0 ? NUMBERS_PI - steep : steep, y);
}

/* Spans of all edges. Beams stay between -1 and the number of beams, so that none is asked that is not there. */
static void measure(const scan_fan *self, const scan_edges *restrict edges, spans *restrict to) {
  const double c = edges->c;
  const double s = edges->s;
  const double reach_squared = edges->reach * edges->reach;
  const double half = self->half;
  const double per_radian = self->per_radian;
  const double margin = self->margin;
  const double most = (double)(self->count - 1);
  for (size_t i = 0; i < edges->count; i++) {
    const double ax = edges->ax[i] * c + edges->ay[i] * s;
    const double ay = edges->ay[i] * c - edges->ax[i] * s;
    const double bx = edges->bx[i] * c + edges->by[i] * s;
    const double by = edges->by[i] * c - edges->bx[i] * s;
    const double ex = bx - ax;
    const double ey = by - ay;
    const double k = ax * ey - ay * ex;
    const double of_a = bearing(ax, ay);
    const double of_b = bearing(bx, by);
    const double low = smaller(of_a, of_b);
    const double high = larger(of_a, of_b);
    const double from = (low + half) * per_radian;
    const double until = (high + half) * per_radian;
    const double square = k * k;
    const double length_squared = ex * ex + ey * ey;
    const double wide = high - low < NEARLY_PI ? SWEPT : AWKWARD;
    const double grazed = square > GRAZING * GRAZING * length_squared ? wide : AWKWARD;
    to->first[i] = (int32_t)smaller(above(larger(from + margin, 0.0)), most + 1.0);
    to->last[i] = (int32_t)below(smaller(larger(until - margin, -1.0), most));
    to->outer_first[i] = (int32_t)smaller(above(larger(from - margin, 0.0)), most + 1.0);
    to->outer_last[i] = (int32_t)below(smaller(larger(until + margin, -1.0), most));
    to->kind[i] = square > reach_squared * length_squared ? UNSEEN : grazed;
    to->ax[i] = ax;
    to->ay[i] = ay;
    to->ex[i] = ex;
    to->ey[i] = ey;
    to->a[i] = ey / k;
    to->b[i] = -ex / k;
    to->low[i] = low;
    to->high[i] = high;
  }
}

/* Where an edge's line lies nearest in beams `first` to `last`: the greatest of a c + b s. */
static inline void sweep(scan_fan *self, long first, long last, double a, double b) {
  const double *c = self->cosine;
  const double *s = self->sine;
  double *restrict inverse = self->inverse;
  for (long i = first; i <= last; i++) inverse[i] = larger(a * c[i] + b * s[i], inverse[i]);
}

/* Beams one by one, so that no crack opens between neighbours. */
static void ask_edge(scan_fan *self, const spans *of, size_t edge, long first, long last) {
  arena_edge e = {.ax = of->ax[edge], .ay = of->ay[edge], .ex = of->ex[edge], .ey = of->ey[edge]};
  e.length_squared = e.ex * e.ex + e.ey * e.ey;
  for (long i = first; i <= last; i++) {
    const ray beam = {0.0, 0.0, self->cosine[i], self->sine[i]};
    const double d = ray_edge(&e, &beam, RAY_MISS);
    if (d < RAY_MISS) scan_keep(self, i, d);
  }
}

/* An edge in the beams that meet it for sure, and one by one in those that may. */
static inline void cover(scan_fan *self, const spans *of, size_t edge, long outer_first, long first, long last,
                         long outer_last) {
  if (first > last) {
    ask_edge(self, of, edge, outer_first, outer_last);
    return;
  }
  if (outer_first < first) ask_edge(self, of, edge, outer_first, first - 1);
  sweep(self, first, last, of->a[edge], of->b[edge]);
  if (outer_last > last) ask_edge(self, of, edge, last + 1, outer_last);
}

static void cover_between(scan_fan *self, const spans *of, size_t edge, double low, double high) {
  const double from = (low + self->half) * self->per_radian;
  const double until = (high + self->half) * self->per_radian;
  long outer_first, first, last, outer_last;
  scan_beams_within(self, from - self->margin, until + self->margin, &outer_first, &outer_last);
  scan_beams_within(self, from + self->margin, until - self->margin, &first, &last);
  cover(self, of, edge, outer_first, first, last, outer_last);
}

/* An edge that the sensor sits almost on, that goes across pi behind the fan's middle, or in line with the sensor. */
static void see_awkward(scan_fan *self, const spans *of, size_t edge) {
  const double low = of->low[edge];
  const double high = of->high[edge];
  const double ex = of->ex[edge];
  const double ey = of->ey[edge];
  const double k = of->ax[edge] * ey - of->ay[edge] * ex;
  if (k == 0.0 || fabs(high - low - NUMBERS_PI) < 1e-3) {
    ask_edge(self, of, edge, 0, (long)self->count - 1);
  } else if (high - low > NUMBERS_PI) {
    cover_between(self, of, edge, high, NUMBERS_PI + SCAN_BEARING_ERROR);
    cover_between(self, of, edge, -NUMBERS_PI - SCAN_BEARING_ERROR, low);
  } else {
    ask_edge(self, of, edge, of->outer_first[edge], of->outer_last[edge]);
  }
}

void scan_see(scan_fan *self, scan_edges *edges) {
  spans found;
  measure(self, edges, &found);
  for (size_t i = 0; i < edges->count; i++) {
    if (found.kind[i] == SWEPT) {
      cover(self, &found, i, found.outer_first[i], found.first[i], found.last[i], found.outer_last[i]);
    } else if (found.kind[i] == AWKWARD) {
      see_awkward(self, &found, i);
    }
  }
  edges->count = 0;
}

/* ray_circle without branches; a reciprocal of 0 where it is missed. */
static inline double ask_circle(double along, double beside, double radius) {
  const double square = radius * radius - beside * beside;
  const double half = sqrt(larger(square, 0.0));
  const double distance = along >= half ? along - half : along + half;
  return (square >= 0.0 && distance >= 0.0) ? 1.0 / distance : 0.0;
}

void scan_see_circle(scan_fan *self, double dx, double dy, double radius, const scan_edges *edges) {
  const double x = dx * edges->c + dy * edges->s;
  const double y = dy * edges->c - dx * edges->s;
  const double square = x * x + y * y;
  double low = -NUMBERS_PI;
  double high = NUMBERS_PI;
  if (square > radius * radius * (1.0 + 1e-9)) {
    const double middle = bearing(x, y);
    const double half = bearing(sqrt(square - radius * radius), radius);
    low = middle - half;
    high = middle + half;
  }
  for (int round = -1; round <= 1; round++) { /* the circle may reach across pi */
    const double shift = round * 2.0 * NUMBERS_PI + self->half;
    long first, last;
    scan_beams_within(self, (low + shift) * self->per_radian - 2.0 * self->margin,
                      (high + shift) * self->per_radian + 2.0 * self->margin, &first, &last);
    double *restrict inverse = self->inverse;
    for (long i = first; i <= last; i++) {
      const double c = self->cosine[i];
      const double s = self->sine[i];
      inverse[i] = larger(ask_circle(x * c + y * s, x * s - y * c, radius), inverse[i]);
    }
  }
}

double scan_farthest(const scan_fan *self) {
  double least[4] = {INFINITY, INFINITY, INFINITY, INFINITY}; /* side by side: none waits for the one before */
  size_t i = 0;
  for (; i + 4 <= self->count; i += 4) {
    for (size_t k = 0; k < 4; k++) least[k] = smaller(self->inverse[i + k], least[k]);
  }
  for (; i < self->count; i++) least[0] = smaller(self->inverse[i], least[0]);
  return 1.0 / smaller(smaller(least[0], least[1]), smaller(least[2], least[3]));
}

void scan_distances(scan_fan *self, double nothing, double *restrict distances) {
  double *restrict inverse = self->inverse;
  for (size_t i = 0; i < self->count; i++) {
    distances[i] = inverse[i] > nothing ? 1.0 / inverse[i] : -1.0;
    inverse[i] = 0.0;
  }
}
