/* ray_fan.c: the nearest item along each of several rays from one point, see arena_fan in arena.h.
 *
 * Four rays of one fan go against an edge at once. What depends on the point and the edge alone, the numerator of (3.6),
 * is computed once. Each lane does the operations of ray_edge in the same order, so its distance has the same bits; a
 * processor with wider registers does the same operations on more lanes and gives the same bits as well.
 */
#include "arena_data.h"

#ifdef __GNUC__

#include <string.h>

#define LANES 4u

typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef int64_t masks __attribute__((vector_size(8 * LANES)));

typedef struct {
  double x, y, reach, height;
  const double *cosine, *sine; /* of LANES rays */
} fan;

/* Rays along the edge, where no division can tell. */
__attribute__((noinline)) static void ask_along(const arena_edge *e, const fan *f, double *nearest) {
  for (unsigned i = 0; i < LANES; i++) {
    const ray r = {f->x, f->y, f->cosine[i], f->sine[i]};
    const double d = ray_edge(e, &r, nearest[i]);
    if (d < nearest[i]) nearest[i] = d;
  }
}

__attribute__((noinline)) static void ask_disc(const arena_disc *disc, const fan *f, double *nearest) {
  for (unsigned i = 0; i < LANES; i++) {
    const ray r = {f->x, f->y, f->cosine[i], f->sine[i]};
    const double d = ray_disc(disc, &r);
    if (d < nearest[i]) nearest[i] = d;
  }
}

#define INLINE static inline __attribute__((always_inline))

/* ray_edge for LANES rays. */
INLINE void ask_edge(const arena_edge *e, const fan *f, const lanes *cosine, const lanes *sine, lanes *nearest) {
  const double wx = f->x - e->ax;
  const double wy = f->y - e->ay;
  const double numerator = e->ex * wy - e->ey * wx;
  const lanes none = {0};
  const lanes signed_den = e->ey * *cosine - e->ex * *sine;
  const masks sign = (masks)signed_den & INT64_MIN;
  const lanes den = (lanes)((masks)signed_den & INT64_MAX);
  const lanes t = (lanes)((masks)(numerator + none) ^ sign);
  const lanes u = (lanes)((masks)(*cosine * wy - *sine * wx) ^ sign);
  const masks across = den * den > 1e-24 * e->length_squared;
  if ((across[0] & across[1] & across[2] & across[3]) == 0) {
    ask_along(e, f, (double *)nearest);
    return;
  }
  const lanes slack = RAY_CRACK * den;
  const lanes distance = t / den;
  const masks nearer = (t >= none) & (u >= -slack) & (u <= den + slack) & (distance < *nearest);
  *nearest = (lanes)(((masks)distance & nearer) | ((masks)*nearest & ~nearer));
}

INLINE double largest(const lanes *value) {
  const double a = (*value)[0] > (*value)[1] ? (*value)[0] : (*value)[1];
  const double b = (*value)[2] > (*value)[3] ? (*value)[2] : (*value)[3];
  return a > b ? a : b;
}

/* Asks the list until the rest cannot be nearer to any ray. Returns 0 if that does not settle the answer. */
INLINE int ask_list(const arena *self, const fan *f, const ray_list_entry *entry, double *nearest) {
  lanes cosine, sine, best;
  memcpy(&cosine, f->cosine, sizeof cosine);
  memcpy(&sine, f->sine, sizeof sine);
  memcpy(&best, nearest, sizeof best);
  for (; (double)entry->bound <= largest(&best); entry++) {
    if (entry->strip == RAY_LIST_END) return 0;
    const uint32_t first = ray_strip_first(entry->strip);
    if (first >= self->edge_count) {
      const arena_disc *disc = &self->disc[first - self->edge_count];
      if (disc->height >= f->height) ask_disc(disc, f, (double *)&best);
      continue;
    }
    const arena_edge *e = &self->edge[first];
    for (uint32_t left = ray_strip_count(entry->strip); left > 0; left--, e++) {
      if (e->height >= f->height) ask_edge(e, f, &cosine, &sine, &best);
    }
  }
  memcpy(nearest, &best, sizeof best);
  return 1;
}

static int ask_any(const arena *self, const fan *f, const ray_list_entry *entry, double *nearest) {
  return ask_list(self, f, entry, nearest);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static int ask_avx2(const arena *self, const fan *f, const ray_list_entry *entry,
                                                    double *nearest) {
  return ask_list(self, f, entry, nearest);
}
#endif

static int ask(const arena *self, const fan *f, const ray_list_entry *entry, double *nearest) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return ask_avx2(self, f, entry, nearest);
#endif
  return ask_any(self, f, entry, nearest);
}

/* The list that serves all of the fan's rays. NULL: there is none, as the fan is too wide or its cell has no lists. */
static const ray_list_entry *list_of(const ray_lists *lists, const fan *f) {
  size_t number_of_cell;
  const ray_list_cell *cell = ray_lists_at(lists, f->x, f->y, &number_of_cell);
  if (cell == NULL) return NULL;
  const unsigned first = ray_sector(lists, f->cosine[0], f->sine[0]);
  if (first >= RAY_SECTORS_MOST) return NULL;
  const unsigned number = first / RAY_FAN_STEP;
  const unsigned from = number * RAY_FAN_STEP;
  for (unsigned i = 1; i < LANES; i++) {
    const unsigned sector = ray_sector(lists, f->cosine[i], f->sine[i]);
    const unsigned after = sector >= from ? sector - from : sector + (unsigned)lists->sectors - from;
    if (sector >= RAY_SECTORS_MOST || after >= RAY_FAN_SECTORS) return NULL;
  }
  return &cell->entry[cell->fan_start[number]];
}

/* Up to LANES rays. Returns 0 where they are to be asked one by one. */
static int few(const arena *self, double x, double y, const double *cosine, const double *sine, size_t count,
               double reach, double height, double *distances) {
  double c[LANES], s[LANES], nearest[LANES];
  const double limit = reach < 1e9 ? reach : 1e9;
  for (size_t i = 0; i < LANES; i++) { /* the last ray fills the lanes that are left */
    const size_t from = i < count ? i : count - 1;
    c[i] = cosine[from];
    s[i] = sine[from];
    nearest[i] = limit;
    const double length = c[i] * c[i] + s[i] * s[i];
    if (!(length > 0.5 && length < 2.0)) return 0;
  }
  const fan f = {x, y, limit, height, c, s};
  const ray_list_entry *entry = list_of(self->lists, &f);
  if (entry == NULL || !ask(self, &f, entry, nearest)) return 0;
  for (size_t i = 0; i < count; i++) distances[i] = nearest[i] < limit ? nearest[i] : -1.0;
  return 1;
}

#else

#define LANES 4u

static int few(const arena *self, double x, double y, const double *cosine, const double *sine, size_t count,
               double reach, double height, double *distances) {
  (void)self, (void)x, (void)y, (void)cosine, (void)sine, (void)count, (void)reach, (void)height, (void)distances;
  return 0;
}

#endif

void arena_fan(const arena *self, double x, double y, const double *cosine, const double *sine, size_t count,
               double reach, double height, double *distances) {
  const int usable = self->lists != NULL && self->grid.columns > 0 && reach > 0.0 && x * x + y * y < 1e18;
  for (size_t first = 0; first < count; first += LANES) {
    const size_t some = count - first < LANES ? count - first : LANES;
    if (usable && some > 1 &&
        few(self, x, y, cosine + first, sine + first, some, reach, height, distances + first))
      continue;
    for (size_t i = first; i < first + some; i++)
      distances[i] = arena_ray(self, x, y, cosine[i], sine[i], reach, height, NULL);
  }
}
