/* ray_fan.c: the nearest item along each of several rays from one point, see arena_fan in arena.h.
 *
 * Four rays of one fan go against an edge at once. What depends on the point and the edge alone, the numerator of (3.6),
 * is computed once. Each ray's distance comes from the operations of ray_edge in the same order, so it has the same bits;
 * loops of four turns without branches become vectors.
 */
#include "arena_data.h"

#define GROUP RAY_FAN_GROUP
#define AT_ONCE 4u /* entries that are asked before the first look at whether the rest can be nearer */
#define FARTHEST 1e9

/* Directions of four rays. */
typedef struct {
  double cosine[GROUP], sine[GROUP];
} group;

void ray_fan_set(ray_fan *self, const double *cosine, const double *sine, size_t count) {
  const double aside = 1e-10; /* lists cover more than that beside their directions */
  *self = (ray_fan){.rays = (uint32_t)count};
  for (size_t i = 0; i < RAY_FAN_MOST; i++) { /* the last ray fills the group that it is in */
    self->cosine[i] = cosine[i < count ? i : count - 1];
    self->sine[i] = sine[i < count ? i : count - 1];
  }
  for (size_t first = 0; first < count; first += GROUP) {
    const double c = self->cosine[first];
    const double s = self->sine[first];
    int alike = 1;
    for (size_t i = first; i < first + GROUP; i++) {
      const double square = self->cosine[i] * self->cosine[i] + self->sine[i] * self->sine[i];
      alike &= fabs(square - 1.0) < 1e-9 && c * self->cosine[i] + s * self->sine[i] >= RAY_FAN_COSINE &&
               c * self->sine[i] - s * self->cosine[i] >= -aside;
    }
    self->alike |= (uint32_t)alike << first / GROUP;
  }
}

/* (3.10), (3.11) */
static inline void turn(const fan_question *q, size_t first, group *out) {
  for (size_t k = 0; k < GROUP; k++) {
    out->cosine[k] = q->cosine * q->rays->cosine[first + k] - q->sine * q->rays->sine[first + k];
    out->sine[k] = q->sine * q->rays->cosine[first + k] + q->cosine * q->rays->sine[first + k];
  }
}

/* ray_edge for four rays. `thinnest` stays above 0 unless one of them goes along the edge, where a division by zero says nothing. */
NUMBERS_INLINE void ask_edge(const arena_edge *e, double x, double y, const group *rays, double nearest[GROUP],
                             double thinnest[GROUP]) {
  const double wx = x - e->ax;
  const double wy = y - e->ay;
  const double numerator = e->ex * wy - e->ey * wx;
  const double least = 1e-24 * e->length_squared;
  for (size_t k = 0; k < GROUP; k++) {
    const double signed_den = e->ey * rays->cosine[k] - e->ex * rays->sine[k];
    const double sign = copysign(1.0, signed_den);
    const double den = fabs(signed_den);
    const double t = sign * numerator;
    const double u = sign * (rays->cosine[k] * wy - rays->sine[k] * wx);
    const double slack = RAY_CRACK * den;
    const double ahead = t >= 0.0 ? t / den : RAY_MISS;
    const double after = u >= -slack ? ahead : RAY_MISS;
    const double met = u <= den + slack ? after : RAY_MISS;
    const double thin = den * den - least;
    nearest[k] = met < nearest[k] ? met : nearest[k];
    thinnest[k] = thin < thinnest[k] ? thin : thinnest[k];
  }
}

static double disc_or(double nearest, const arena_disc *disc, double x, double y, double cosine, double sine) {
  const double d = ray_disc(disc, &(ray){x, y, cosine, sine});
  return d < nearest ? d : nearest;
}

/* Asks the list for four rays until the rest cannot be nearer to any. Returns 0 if that does not settle the answer. */
NUMBERS_INLINE int ask_list(const fan_question *q, const group *rays, const ray_list_entry *entry, double limit,
                            double distances[GROUP]) {
  const arena *where = q->where;
  const uint32_t edges = (uint32_t)where->edge_count;
  const ray_list_entry *const early = entry + AT_ONCE;
  const double x = q->x;
  const double y = q->y;
  double nearest[GROUP] = {limit, limit, limit, limit};
  double thinnest[GROUP] = {1.0, 1.0, 1.0, 1.0};
  for (; (double)entry->bound <= limit; entry++) {
    const double bound = (double)entry->bound;
    /* What was met is known late: looking at it for each entry costs more than the entries that it spares. */
    if (entry >= early || entry->item == RAY_LIST_END) {
      int open = 0;
      for (size_t k = 0; k < GROUP; k++) open |= nearest[k] >= bound;
      if (!open) break;
    }
    if (entry->item == RAY_LIST_END) return 0;
    if (entry->item < edges) {
      const arena_edge *edge = &where->edge[entry->item];
      if (edge->height >= q->height) ask_edge(edge, x, y, rays, nearest, thinnest);
    } else {
      const arena_disc *disc = &where->disc[entry->item - edges];
      for (size_t k = 0; k < GROUP && disc->height >= q->height; k++)
        nearest[k] = disc_or(nearest[k], disc, x, y, rays->cosine[k], rays->sine[k]);
    }
  }
  double thin = 1.0;
  for (size_t k = 0; k < GROUP; k++) {
    thin = thinnest[k] < thin ? thinnest[k] : thin;
    distances[k] = nearest[k] < limit ? nearest[k] : -1.0;
  }
  return thin > 0.0;
}

/* The lists for a question, NULL: there are none. */
static const ray_list_cell *cell_of(const fan_question *q) {
  if (q->where->lists == NULL || q->where->grid.columns == 0 || !(q->reach > 0.0)) return NULL;
  if (!(fabs(q->cosine * q->cosine + q->sine * q->sine - 1.0) < 1e-9)) return NULL;
  return ray_lists_at(q->where->lists, q->x, q->y);
}

void arena_fan(const fan_question *q) {
  const double limit = q->reach < FARTHEST ? q->reach : FARTHEST;
  const ray_list_cell *cell = cell_of(q);
  for (size_t first = 0; first < q->rays->rays; first += GROUP) {
    group rays;
    turn(q, first, &rays);
    if (cell != NULL && q->rays->alike >> first / GROUP & 1u) {
      const ray_list_entry *list = cell->list[ray_list_for(rays.cosine[0], rays.sine[0])];
      if (ask_list(q, &rays, list, limit, &q->distances[first])) continue;
    }
    for (size_t k = 0; k < GROUP && first + k < q->rays->rays; k++)
      q->distances[first + k] =
          arena_ray(q->where, q->x, q->y, rays.cosine[k], rays.sine[k], q->reach, q->height, NULL);
  }
}
