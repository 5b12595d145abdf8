/* ray_fan.c: the nearest item along each of several rays from one point, see arena_fans in arena.h.
 *
 * Four rays of one fan go against an edge at once. What depends on the point and the edge alone, the numerator of (3.6),
 * is computed once. Each lane does the operations of ray_edge in the same order, so its distance has the same bits. First
 * the lists of many fans are looked up, then asked: each is a chain of operations that wait for each other, and the
 * processor works on several chains at once where they stand close together in the program.
 */
#include "arena_data.h"
#include "lanes.h"

#define AT_ONCE 4u  /* entries that are asked before the first look at whether the rest can be nearer */
#define TOGETHER 16 /* groups of rays whose lists are looked up before the first is asked */
#define FARTHEST 1e9

void ray_fan_set(ray_fan *self, const double *cosine, const double *sine, size_t count) {
  const double aside = 1e-10; /* lists know more than that beside their sectors */
  *self = (ray_fan){.rays = (uint32_t)count};
  for (size_t i = 0; i < RAY_FAN_MOST; i++) { /* the last ray fills the lanes that are left */
    self->cosine[i] = cosine[i < count ? i : count - 1];
    self->sine[i] = sine[i < count ? i : count - 1];
  }
  for (size_t first = 0; first < count; first += RAY_FAN_GROUP) {
    const double c = self->cosine[first];
    const double s = self->sine[first];
    int alike = 1;
    for (size_t i = first; i < first + RAY_FAN_GROUP; i++) {
      const double square = self->cosine[i] * self->cosine[i] + self->sine[i] * self->sine[i];
      alike &= fabs(square - 1.0) < 1e-9 && c * self->cosine[i] + s * self->sine[i] >= RAY_FAN_COSINE &&
               c * self->sine[i] - s * self->cosine[i] >= -aside;
    }
    self->alike |= (uint32_t)alike << first / RAY_FAN_GROUP;
  }
}

/* Four rays by themselves. */
static void one_by_one(const fan_question *q, size_t first) {
  for (size_t i = first; i < first + RAY_FAN_GROUP; i++) {
    q->distances[i] = -1.0;
    if (i >= q->rays->rays) continue;
    const double cosine = q->cosine * q->rays->cosine[i] - q->sine * q->rays->sine[i];
    const double sine = q->sine * q->rays->cosine[i] + q->cosine * q->rays->sine[i];
    q->distances[i] = arena_ray(q->where, q->x, q->y, cosine, sine, q->reach, q->height, NULL);
  }
}

#ifdef __GNUC__

_Static_assert(LANES == RAY_FAN_GROUP, "a group fills the lanes");

/* Directions of four rays. */
typedef struct {
  lanes cosine, sine;
} directions;

/* A group of rays, and the list that it asks. */
typedef struct {
  directions to;
  const fan_question *from;
  const ray_list_cell *cell;
  const ray_list_entry *list; /* NULL: one by one */
  size_t first;               /* ray */
} group;

/* (3.10), (3.11) */
LANES_INLINE void turn(const fan_question *q, size_t first, directions *out) {
  lanes c, s;
  lanes_load(&c, &q->rays->cosine[first]);
  lanes_load(&s, &q->rays->sine[first]);
  out->cosine = q->cosine * c - q->sine * s;
  out->sine = q->sine * c + q->cosine * s;
}

/* ray_edge for four rays. Lanes along the edge, where no division can tell, are noted in `along`. */
LANES_INLINE void ask_edge(const arena_edge *e, double x, double y, const directions *to, lanes *nearest,
                           masks *along) {
  const double wx = x - e->ax;
  const double wy = y - e->ay;
  const double numerator = e->ex * wy - e->ey * wx;
  const double least = 1e-24 * e->length_squared;
  const lanes signed_den = e->ey * to->cosine - e->ex * to->sine;
  const masks sign = (masks)signed_den & INT64_MIN;
  const lanes den = (lanes)((masks)signed_den & INT64_MAX);
  const lanes t = (lanes)((masks)lanes_of(numerator) ^ sign);
  const lanes u = (lanes)((masks)(to->cosine * wy - to->sine * wx) ^ sign);
  const lanes slack = RAY_CRACK * den;
  const lanes distance = t / den;
  const masks nearer =
      (t >= 0.0) & (u >= (lanes)((masks)slack ^ INT64_MIN)) & (u <= den + slack) & (distance < *nearest);
  *along |= den * den <= least;
  *nearest = lanes_select(nearer, distance, *nearest);
}

LANES_NOT_INLINE static void ask_disc(const arena_disc *disc, double x, double y, const directions *to,
                                      lanes *nearest) {
  for (size_t i = 0; i < LANES; i++) {
    const ray r = {x, y, to->cosine[i], to->sine[i]};
    const double d = ray_disc(disc, &r);
    if (d < (*nearest)[i]) (*nearest)[i] = d;
  }
}

/* Asks the list until the rest cannot be nearer to any ray. Returns 0 if that does not settle the answer. */
LANES_INLINE int ask_list(const group *g, double limit, lanes *nearest) {
  const fan_question *q = g->from;
  const arena *where = q->where;
  const double x = q->x;
  const double y = q->y;
  const double height = q->height;
  const float far = (float)(limit * (1.0 + 1e-6)); /* no less than the limit: one entry too many changes nothing */
  const directions to = g->to;
  lanes best = lanes_of(limit);
  masks along = {0};
  const uint32_t edges = (uint32_t)where->edge_count;
  const arena_edge *const edge = where->edge;
  const ray_list_entry *entry = g->list;
  const ray_list_entry *const early = entry + AT_ONCE;
  for (; entry->bound <= far; entry++) {
    const uint32_t strip = entry->strip;
    /* What was met is known late: looking at it for each entry costs more than the entries that it spares. */
    if (entry >= early) {
      const masks open = best >= (double)entry->bound;
      if (!masks_any(&open)) break;
    }
    if (strip < edges) { /* one edge */
      if (edge[strip].height >= height) ask_edge(&edge[strip], x, y, &to, &best, &along);
      continue;
    }
    if (strip == RAY_LIST_END) {
      const masks open = best >= (double)entry->bound;
      if (!masks_any(&open)) break;
      return 0;
    }
    const uint32_t first = ray_strip_first(strip);
    if (first >= edges) {
      const arena_disc *disc = &where->disc[first - edges];
      if (!(disc->height >= height)) continue;
      lanes in_memory = best;
      ask_disc(disc, x, y, &g->to, &in_memory);
      best = in_memory;
      continue;
    }
    for (const arena_edge *e = &edge[first]; e < &edge[first] + ray_strip_count(strip); e++) {
      if (e->height >= height) ask_edge(e, x, y, &to, &best, &along);
    }
  }
  *nearest = best;
  return !masks_any(&along);
}

/* The lists of the cell where a group of rays starts that point much the same way. */
LANES_INLINE void find_cell(group *g) {
  const fan_question *q = g->from;
  const ray_lists *lists = q->where->lists;
  size_t number;
  g->cell = NULL;
  if (lists == NULL || q->where->grid.columns == 0 || !(q->reach > 0.0)) return;
  if (!(q->rays->alike >> g->first / RAY_FAN_GROUP & 1u)) return;
  if (!(fabs(q->cosine * q->cosine + q->sine * q->sine - 1.0) < 1e-9)) return;
  g->cell = ray_lists_at(lists, q->x, q->y, &number);
}

/* The one for where they point to. */
LANES_INLINE void find_list(group *g) {
  const fan_question *q = g->from;
  g->list = NULL;
  if (g->cell == NULL) return;
  turn(q, g->first, &g->to);
  const unsigned sector = ray_sector(q->where->lists, g->to.cosine[0], g->to.sine[0]);
  if (sector >= RAY_SECTORS_MOST) return;
  g->list = &g->cell->entry[g->cell->fan_start[sector / RAY_FAN_STEP]];
  __builtin_prefetch(g->list);
}

/* Writes four distances. */
LANES_INLINE void ask_group(const group *g) {
  const fan_question *q = g->from;
  const double limit = q->reach < FARTHEST ? q->reach : FARTHEST;
  lanes nearest;
  if (g->list == NULL || !ask_list(g, limit, &nearest)) {
    one_by_one(q, g->first);
    return;
  }
  const lanes none = lanes_of(-1.0);
  nearest = lanes_select(nearest < limit, nearest, none);
  lanes_store(&q->distances[g->first], &nearest);
}

/* Each look into memory is begun for all groups before the first of them needs what is there. */
LANES_INLINE void ask_groups(group groups[], size_t count) {
  for (size_t k = 0; k < count; k++) {
    find_cell(&groups[k]);
    if (groups[k].cell != NULL) __builtin_prefetch(groups[k].cell->fan_start);
  }
  for (size_t k = 0; k < count; k++) find_list(&groups[k]);
  for (size_t k = 0; k < count; k++) ask_group(&groups[k]);
}

LANES_INLINE void arena_fans_inline(const fan_question *questions, size_t count) {
  group groups[TOGETHER];
  size_t waiting = 0;
  for (size_t i = 0; i < count; i++) {
    size_t first = 0;
    do {
      if (waiting == TOGETHER) {
        ask_groups(groups, waiting);
        waiting = 0;
      }
      groups[waiting].from = &questions[i];
      groups[waiting++].first = first;
      first += RAY_FAN_GROUP;
    } while (first < questions[i].rays->rays);
  }
  ask_groups(groups, waiting);
}

LANES_FUNCTION(extern, arena_fans, (const fan_question *questions, size_t count), (questions, count))

#else

void arena_fans(const fan_question *questions, size_t count) {
  for (size_t i = 0; i < count; i++) {
    for (size_t first = 0; first < questions[i].rays->rays; first += RAY_FAN_GROUP) one_by_one(&questions[i], first);
  }
}

#endif
