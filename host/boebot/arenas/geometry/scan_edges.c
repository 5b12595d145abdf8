/* scan_edges.c: edges before the fan of a laser range finder, see scan_look.c.
 *
 * In the sensor's frame, turned so that the fan's middle lies on the x axis, an edge from a with direction e meets the
 * beam (c, s) at the distance K / (e_y c - e_x s) with K = a_x e_y - a_y e_x, from (3.6). The beams keep the reciprocal
 * of the least distance: it is linear in c and s, needs no division, and the largest one wins.
 */
#include "scan_fan.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "numbers.h"
#include "scan_lanes.h"

#ifndef SCAN_KERNELS
#define SCAN_KERNELS scan_kernels_any
#endif

#define GRAZING 1e-9 /* m: edges whose line passes the sensor so closely are asked beam by beam */
#define NEARLY_PI (NUMBERS_PI - 1e-3)

enum { UNSEEN, SWEPT, AWKWARD };

/* What is known of each edge of a block in the fan's frame. */
typedef struct {
  double ax[SCAN_BLOCK], ay[SCAN_BLOCK], ex[SCAN_BLOCK], ey[SCAN_BLOCK];
  double a[SCAN_BLOCK], b[SCAN_BLOCK];                     /* 1 / distance = a c + b s */
  double low[SCAN_BLOCK], high[SCAN_BLOCK];                /* bearings of its ends */
  int32_t first[SCAN_BLOCK], last[SCAN_BLOCK];             /* beams that surely meet it */
  int32_t outer_first[SCAN_BLOCK], outer_last[SCAN_BLOCK]; /* beams that may meet it */
  int32_t kind[SCAN_BLOCK];
} spans;

/* Direction of (x, y) in [-pi, pi], to 1e-5: Abramowitz and Stegun, 4.4.49 on the smaller of both ratios. */
static inline lanes bearing(lanes x, lanes y) {
  const lanes ax = lanes_size(x);
  const lanes ay = lanes_size(y);
  const lanes larger = lanes_larger(ax, ay);
  const lanes ratio = lanes_smaller(ax, ay) / lanes_larger(larger, lanes_all(0x1p-1000)); /* 0 for (0, 0) */
  const lanes z = ratio * ratio;
  const lanes sum = 0.9998660 + z * (-0.3302995 + z * (0.1801410 + z * (-0.0851330 + z * 0.0208351)));
  lanes angle = ratio * sum;
  angle = lanes_pick(ax > ay, angle, 0.5 * NUMBERS_PI - angle);
  angle = lanes_pick(x < 0.0, NUMBERS_PI - angle, angle);
  return lanes_with_sign(angle, y);
}

/* Beams between the bearings low and high: first and last of those that surely lie between, and of those that may. They
 * stay between -1 and the number of beams, so that none is asked that is not there. */
static inline void measure_beams(const scan_fan *self, lanes low, lanes high, size_t i, spans *to) {
  const lanes zero = lanes_all(0.0);
  const lanes before = lanes_all(-1.0);
  const lanes most = lanes_all((double)(self->count - 1));
  const lanes from = (low + self->half) * self->per_radian;
  const lanes until = (high + self->half) * self->per_radian;
  const lanes first = lanes_smaller(lanes_ceil(lanes_larger(from + self->margin, zero)), most + 1.0);
  const lanes last = lanes_floor(lanes_smaller(lanes_larger(until - self->margin, before), most));
  const lanes outer_first = lanes_smaller(lanes_ceil(lanes_larger(from - self->margin, zero)), most + 1.0);
  const lanes outer_last = lanes_floor(lanes_smaller(lanes_larger(until + self->margin, before), most));
  lanes_store_int(&to->first[i], lanes_whole(first));
  lanes_store_int(&to->last[i], lanes_whole(last));
  lanes_store_int(&to->outer_first[i], lanes_whole(outer_first));
  lanes_store_int(&to->outer_last[i], lanes_whole(outer_last));
}

/* Spans of the edges `i` and on, one to a lane. */
static inline void measure(const scan_fan *self, const scan_edges *edges, size_t i, spans *to) {
  const lanes ax = lanes_load(&edges->ax[i]) * edges->c + lanes_load(&edges->ay[i]) * edges->s;
  const lanes ay = lanes_load(&edges->ay[i]) * edges->c - lanes_load(&edges->ax[i]) * edges->s;
  const lanes bx = lanes_load(&edges->bx[i]) * edges->c + lanes_load(&edges->by[i]) * edges->s;
  const lanes by = lanes_load(&edges->by[i]) * edges->c - lanes_load(&edges->bx[i]) * edges->s;
  const lanes ex = bx - ax;
  const lanes ey = by - ay;
  const lanes k = ax * ey - ay * ex;
  const lanes of_a = bearing(ax, ay);
  const lanes of_b = bearing(bx, by);
  const lanes low = lanes_smaller(of_a, of_b);
  const lanes high = lanes_larger(of_a, of_b);
  const lanes square = k * k;
  const lanes length_squared = ex * ex + ey * ey;
  const lanes_mask smooth = (high - low < NEARLY_PI) & (square > GRAZING * GRAZING * length_squared);
  const lanes_mask far = square > edges->reach * edges->reach * length_squared;
  const lanes kind = lanes_pick(smooth, lanes_all(SWEPT), lanes_all(AWKWARD));
  measure_beams(self, low, high, i, to);
  lanes_store(&to->ax[i], ax);
  lanes_store(&to->ay[i], ay);
  lanes_store(&to->ex[i], ex);
  lanes_store(&to->ey[i], ey);
  lanes_store(&to->a[i], ey / k);
  lanes_store(&to->b[i], lanes_all(0.0) - ex / k);
  lanes_store(&to->low[i], low);
  lanes_store(&to->high[i], high);
  lanes_store_int(&to->kind[i], lanes_whole(lanes_pick(far, lanes_all(UNSEEN), kind)));
}

/* Of the register that begins with beam i, the beams `first` to `last`. */
static inline lanes_mask within(long i, long first, long last) {
  static const int64_t window[] = {
#if LANES == 4
    0,
    0,
    0,
    -1,
    -1,
    -1,
    -1,
    0,
    0,
    0
#elif LANES == 2
    0,
    -1,
    -1,
    0
#else
    -1
#endif
  };
  const long before = first > i ? first - i : 0;
  const long behind = i + LANES - 1 > last ? i + LANES - 1 - last : 0;
  return lanes_load_mask(&window[LANES - 1 - before]) & lanes_load_mask(&window[LANES - 1 + behind]);
}

static inline void take(scan_fan *self, long i, lanes inverse) {
  lanes_store(&self->inverse[i], lanes_larger(inverse, lanes_load(&self->inverse[i])));
}

/* Where an edge's line lies nearest in beams `first` to `last`: the greatest of a c + b s. */
static inline void sweep(scan_fan *self, long first, long last, double a, double b) {
  const double *c = self->cosine;
  const double *s = self->sine;
  long i = first - first % LANES;
  take(self, i, lanes_keep(within(i, first, last), a * lanes_load(&c[i]) + b * lanes_load(&s[i])));
  for (i += LANES; i + LANES <= last + 1; i += LANES) take(self, i, a * lanes_load(&c[i]) + b * lanes_load(&s[i]));
  if (i <= last) take(self, i, lanes_keep(within(i, first, last), a * lanes_load(&c[i]) + b * lanes_load(&s[i])));
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

static void see(scan_fan *self, scan_edges *edges) {
  spans found;
  const size_t count = edges->count;
  for (size_t i = count; i % LANES != 0; i++) { /* what fills the last register is the last edge again */
    edges->ax[i] = edges->ax[count - 1];
    edges->ay[i] = edges->ay[count - 1];
    edges->bx[i] = edges->bx[count - 1];
    edges->by[i] = edges->by[count - 1];
  }
  for (size_t i = 0; i < count; i += LANES) measure(self, edges, i, &found);
  for (size_t i = 0; i < count; i++) {
    if (found.kind[i] == SWEPT) {
      cover(self, &found, i, found.outer_first[i], found.first[i], found.last[i], found.outer_last[i]);
    } else if (found.kind[i] == AWKWARD) {
      see_awkward(self, &found, i);
    }
  }
  edges->count = 0;
}

/* ray_circle for the beams of a register; a reciprocal of 0 where it is missed. */
static inline lanes ask_circle(lanes along, lanes beside, double radius) {
  const lanes square = radius * radius - beside * beside;
  const lanes half = lanes_root(lanes_larger(square, lanes_all(0.0)));
  const lanes before = along - half;
  const lanes behind = along + half;
  const lanes distance = lanes_pick(along >= half, before, behind);
  return lanes_keep((square >= 0.0) & (distance >= 0.0), 1.0 / distance);
}

static double one_bearing(double x, double y) {
  double angle[LANES];
  lanes_store(angle, bearing(lanes_all(x), lanes_all(y)));
  return angle[0];
}

static void see_circle(scan_fan *self, double dx, double dy, double radius, const scan_edges *edges) {
  const double x = dx * edges->c + dy * edges->s;
  const double y = dy * edges->c - dx * edges->s;
  const double square = x * x + y * y;
  double low = -NUMBERS_PI;
  double high = NUMBERS_PI;
  if (square > radius * radius * (1.0 + 1e-9)) {
    const double middle = one_bearing(x, y);
    const double half = one_bearing(sqrt(square - radius * radius), radius);
    low = middle - half;
    high = middle + half;
  }
  for (int round = -1; round <= 1; round++) { /* the circle may reach across pi */
    const double shift = round * 2.0 * NUMBERS_PI + self->half;
    long first, last;
    scan_beams_within(self, (low + shift) * self->per_radian - 2.0 * self->margin,
                      (high + shift) * self->per_radian + 2.0 * self->margin, &first, &last);
    for (long i = first - first % LANES; i <= last; i += LANES) {
      const lanes c = lanes_load(&self->cosine[i]);
      const lanes s = lanes_load(&self->sine[i]);
      take(self, i, lanes_keep(within(i, first, last), ask_circle(x * c + y * s, x * s - y * c, radius)));
    }
  }
}

static double farthest(const scan_fan *self) {
  const size_t whole = self->count / LANES * LANES;
  lanes smallest = lanes_all(INFINITY);
  for (size_t i = 0; i < whole; i += LANES) smallest = lanes_smaller(lanes_load(&self->inverse[i]), smallest);
  double values[LANES];
  lanes_store(values, smallest);
  double least = values[0];
  for (size_t i = 1; i < LANES; i++) least = values[i] < least ? values[i] : least;
  for (size_t i = whole; i < self->count; i++) least = self->inverse[i] < least ? self->inverse[i] : least;
  return 1.0 / least;
}

static void distances_of(scan_fan *self, double nothing, double *distances) {
  const size_t count = self->count;
  for (size_t i = 0; i < count; i += LANES) {
    const lanes inverse = lanes_load(&self->inverse[i]);
    const lanes found = lanes_pick(inverse > nothing, 1.0 / inverse, lanes_all(-1.0));
    lanes_store(&self->inverse[i], lanes_all(0.0));
    if (i + LANES <= count) {
      lanes_store(&distances[i], found);
    } else {
      double rest[LANES];
      lanes_store(rest, found);
      memcpy(&distances[i], rest, (count - i) * sizeof *rest);
    }
  }
}

static inline lanes spread_of(lanes distance, lanes draw, double sigma, double reach) {
  const lanes noisy = distance * (1.0 + sigma * draw); /* (3.1) */
  const lanes kept = lanes_smaller(lanes_larger(noisy, lanes_all(0.0)), lanes_all(reach));
  return lanes_pick(distance < 0.0, distance, kept);
}

static void spread(double *distances, const double *draws, size_t count, double sigma, double reach) {
  size_t i = 0;
  for (; i + LANES <= count; i += LANES)
    lanes_store(&distances[i], spread_of(lanes_load(&distances[i]), lanes_load(&draws[i]), sigma, reach));
  if (i == count) return;
  double rest[2][LANES] = {{0.0}};
  memcpy(rest[0], &distances[i], (count - i) * sizeof *distances);
  memcpy(rest[1], &draws[i], (count - i) * sizeof *draws);
  lanes_store(rest[0], spread_of(lanes_load(rest[0]), lanes_load(rest[1]), sigma, reach));
  memcpy(&distances[i], rest[0], (count - i) * sizeof *distances);
}

const scan_kernels SCAN_KERNELS = {see, see_circle, farthest, distances_of, spread};
