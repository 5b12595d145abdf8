/* ray_fan.c: the nearest item along each of several rays from one point, see arena_fan in arena.h.
 *
 * Four rays of one fan go against an edge at once. What depends on the point and the edge alone, the numerator of (3.6),
 * is computed once. Each lane does the operations of ray_edge in the same order, so its distance has the same bits; a
 * processor with wider registers does the same operations on more lanes and gives the same bits as well.
 */
#include <string.h>

#include "arena_data.h"

#define LANES 4u

/* `some` rays, 1 to LANES, and what their question is. */
typedef struct {
  double x, y;
  const double *cosine, *sine;
  size_t some;
  double limit, height;
} fan;

#ifdef __GNUC__

#define INLINE static inline __attribute__((always_inline))
#define NOT_INLINE __attribute__((noinline))

#define ASIDE \
  1e-10 /* lists know more than that beside their sectors; the first ray's own cross product may be rounded */

typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef int64_t masks __attribute__((vector_size(8 * LANES)));

INLINE int any(const masks *m) { return ((*m)[0] | (*m)[1] | (*m)[2] | (*m)[3]) != 0; }

INLINE double largest(const lanes *value) {
  const double a = (*value)[0] > (*value)[1] ? (*value)[0] : (*value)[1];
  const double b = (*value)[2] > (*value)[3] ? (*value)[2] : (*value)[3];
  return a > b ? a : b;
}

/* The last ray fills the lanes that are left. */
INLINE void load(const double *from, size_t some, lanes *to) {
  const size_t second = some > 1 ? 1 : 0;
  const size_t third = some > 2 ? 2 : second;
  *to = (lanes){from[0], from[second], from[third], from[some - 1]};
}

/* ray_edge for LANES rays. Lanes along the edge, where no division can tell, are noted in `along`. */
INLINE void ask_edge(const arena_edge *e, const fan *f, const lanes *cosine, const lanes *sine, lanes *nearest,
                     masks *along) {
  const double wx = f->x - e->ax;
  const double wy = f->y - e->ay;
  const double numerator = e->ex * wy - e->ey * wx;
  const double least = 1e-24 * e->length_squared;
  const lanes signed_den = e->ey * *cosine - e->ex * *sine;
  const masks sign = (masks)signed_den & INT64_MIN;
  const lanes den = (lanes)((masks)signed_den & INT64_MAX);
  const lanes t = (lanes)((masks)(lanes){numerator, numerator, numerator, numerator} ^ sign);
  const lanes u = (lanes)((masks)(*cosine * wy - *sine * wx) ^ sign);
  const lanes slack = RAY_CRACK * den;
  const lanes distance = t / den;
  const masks nearer =
      (t >= 0.0) & (u >= (lanes)((masks)slack ^ INT64_MIN)) & (u <= den + slack) & (distance < *nearest);
  *along |= den * den <= least;
  *nearest = (lanes)(((masks)distance & nearer) | ((masks)*nearest & ~nearer));
}

NOT_INLINE static void ask_disc(const arena_disc *disc, const fan *f, double *nearest) {
  for (size_t i = 0; i < LANES; i++) {
    const size_t from = i < f->some ? i : f->some - 1;
    const ray r = {f->x, f->y, f->cosine[from], f->sine[from]};
    const double d = ray_disc(disc, &r);
    if (d < nearest[i]) nearest[i] = d;
  }
}

/* Asks the list until the rest cannot be nearer to any ray. Returns 0 if that does not settle the answer. */
INLINE int ask_list(const arena *self, const fan *f, const ray_list_entry *entry, const lanes *cosine,
                    const lanes *sine, lanes *nearest) {
  lanes best = *nearest;
  masks along = {0};
  for (; (double)entry->bound <= largest(&best); entry++) {
    if (entry->strip == RAY_LIST_END) return 0;
    const uint32_t first = ray_strip_first(entry->strip);
    if (first >= self->edge_count) {
      const arena_disc *disc = &self->disc[first - self->edge_count];
      if (!(disc->height >= f->height)) continue;
      double values[LANES];
      memcpy(values, &best, sizeof values);
      ask_disc(disc, f, values);
      memcpy(&best, values, sizeof values);
      continue;
    }
    const arena_edge *e = &self->edge[first];
    for (uint32_t left = ray_strip_count(entry->strip); left > 0; left--, e++) {
      if (e->height >= f->height) ask_edge(e, f, cosine, sine, &best, &along);
    }
  }
  *nearest = best;
  return !any(&along);
}

/* The list that serves all directions within the angle of RAY_FAN_COSINE to the left of the first. NULL: there is none,
 * as the cell has no lists, or some ray lies outside or is not of length 1. */
INLINE const ray_list_entry *list_of(const ray_lists *lists, const fan *f, const lanes *cosine, const lanes *sine) {
  size_t number;
  const ray_list_cell *cell = ray_lists_at(lists, f->x, f->y, &number);
  if (cell == NULL) return NULL;
  const unsigned first = ray_sector(lists, f->cosine[0], f->sine[0]);
  if (first >= RAY_SECTORS_MOST) return NULL;
  const lanes square = *cosine * *cosine + *sine * *sine;
  const lanes dot = f->cosine[0] * *cosine + f->sine[0] * *sine;
  const lanes cross = f->cosine[0] * *sine - f->sine[0] * *cosine;
  const masks outside = (cross < -ASIDE) | (dot < RAY_FAN_COSINE) | (square < 1.0 - 1e-9) | (square > 1.0 + 1e-9);
  if (any(&outside)) return NULL;
  return &cell->entry[cell->fan_start[first / RAY_FAN_STEP]];
}

/* Returns 0 where the rays are to be asked one by one. */
INLINE int few(const arena *self, const fan *f, double *distances) {
  lanes cosine, sine;
  load(f->cosine, f->some, &cosine);
  load(f->sine, f->some, &sine);
  const ray_list_entry *entry = list_of(self->lists, f, &cosine, &sine);
  if (entry == NULL) return 0;
  const lanes limit = {f->limit, f->limit, f->limit, f->limit};
  lanes nearest = limit;
  if (!ask_list(self, f, entry, &cosine, &sine, &nearest)) return 0;
  const masks met = nearest < limit;
  const lanes found = (lanes)(((masks)nearest & met) | ((masks)(lanes){-1.0, -1.0, -1.0, -1.0} & ~met));
  distances[0] = found[0];
  if (f->some > 1) distances[1] = found[1];
  if (f->some > 2) distances[2] = found[2];
  if (f->some > 3) distances[3] = found[3];
  return 1;
}

NOT_INLINE static int few_anywhere(const arena *self, const fan *f, double *distances) {
  return few(self, f, distances);
}

#if defined(__x86_64__) && !defined(WORLD_PLAIN_LANES) /* the macro: for tests */
NOT_INLINE __attribute__((target("avx2"))) static int few_by_avx2(const arena *self, const fan *f, double *distances) {
  return few(self, f, distances);
}
#endif

static int ask_few(const arena *self, const fan *f, double *distances) {
#if defined(__x86_64__) && !defined(WORLD_PLAIN_LANES) /* the macro: for tests */
  if (__builtin_cpu_supports("avx2")) return few_by_avx2(self, f, distances);
#endif
  return few_anywhere(self, f, distances);
}

#else

static int ask_few(const arena *self, const fan *f, double *distances) {
  (void)self, (void)f, (void)distances;
  return 0;
}

#endif

void arena_fan(const arena *self, double x, double y, const double *cosine, const double *sine, size_t count,
               double reach, double height, double *distances) {
  const int usable = self->lists != NULL && self->grid.columns > 0 && reach > 0.0 && x * x + y * y < 1e18;
  const double limit = reach < 1e9 ? reach : 1e9;
  for (size_t first = 0; first < count; first += LANES) {
    const size_t some = count - first < LANES ? count - first : LANES;
    const fan f = {x, y, cosine + first, sine + first, some, limit, height};
    if (usable && some > 1 && ask_few(self, &f, distances + first)) continue;
    for (size_t i = first; i < first + some; i++)
      distances[i] = arena_ray(self, x, y, cosine[i], sine[i], reach, height, NULL);
  }
}
