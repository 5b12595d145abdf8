/* arena_fingerprint.c: what tells an arena from another one, see arena_fingerprint in arena.h: a hash of all that a world can meet in
 * it. */
#include "arena_data.h"
#include "hash.h"

static uint64_t hash_surface(uint64_t sum, const arena_surface *s) {
  return HASH_NUMBERS(sum, s->height, s->infrared_reflectance, s->sound_reflectance);
}

static uint64_t hash_shape(uint64_t sum, const arena *self, const arena_shape *shape) {
  sum = hash_surface(hash_word(hash_word(sum, (uint64_t)shape->kind), shape->count), &shape->surface);
  if (shape->kind == ARENA_DISC) {
    const arena_disc *d = &self->disc[shape->first];
    return HASH_NUMBERS(sum, d->x, d->y, d->radius);
  }
  for (uint32_t i = 0; i < shape->count; i++) {
    const arena_edge *e = &self->edge[shape->first + i];
    sum = HASH_NUMBERS(sum, e->ax, e->ay, e->ex, e->ey);
  }
  return sum;
}

static uint64_t hash_moving(uint64_t sum, const arena_moving *m) {
  sum = HASH_NUMBERS(hash_surface(sum, &m->surface), m->radius);
  sum = hash_numbers(sum, m->outline, 2 * m->corners);
  sum = hash_word(hash_word(sum, (uint64_t)m->path.repeat), m->path.count);
  for (size_t i = 0; i < m->path.count; i++) {
    const path_waypoint *w = &m->path.waypoints[i];
    sum = HASH_NUMBERS(sum, w->time, w->x, w->y, w->heading);
  }
  return sum;
}

uint64_t arena_compute_fingerprint(const arena *self) {
  uint64_t sum = hash_word(self->shape_count, self->patch_count);
  for (size_t i = 0; i < self->shape_count; i++) sum = hash_shape(sum, self, &self->shape[i]);
  for (size_t i = 0; i < self->patch_count; i++) {
    const arena_patch *p = &self->patch[i];
    sum = HASH_NUMBERS(hash_numbers(sum, p->xy, 2 * p->count), p->grip);
  }
  if (self->line_count > 0) { /* what arenas without lines had before there were any stays */
    sum = HASH_NUMBERS(hash_word(sum, self->line_count), self->floor_reflectance);
    for (size_t i = 0; i < self->line_count; i++) {
      const arena_line *l = &self->line[i];
      sum = HASH_NUMBERS(hash_numbers(sum, l->xy, 2 * l->count), l->half_width, l->reflectance);
    }
  }
  sum = hash_word(sum, self->light_count);
  for (size_t i = 0; i < self->light_count; i++) {
    const arena_light *l = &self->light[i];
    sum = HASH_NUMBERS(sum, l->x, l->y, l->height, l->power);
  }
  sum = hash_word(sum, self->moving_count);
  for (size_t i = 0; i < self->moving_count; i++) sum = hash_moving(sum, &self->moving[i]);
  const arena_charger *c = &self->charger;
  return self->has_charger ? HASH_NUMBERS(sum, c->x, c->y, c->radius) : sum;
}
