/* body_near.c: what of the arena is near a body, and what a segment on it touches; see body.h. Lists of near edges and discs
 * stay good while the body moves by a few centimetres. They save looking, and change no bit of what comes out. */
#include "body.h"

#define CLEARANCE_LIMIT 0.75 /* m */

void body_look_around(body *self, const arena *where, double share) {
  if (body_knows(self, where, share)) return;
  body_surroundings *near = &self->near;
  near->x = self->state.x;
  near->y = self->state.y;
  near->version = arena_version(where);
  near->edge_count = near->disc_count = 0;
  const double clearance = arena_clearance(where, near->x, near->y, CLEARANCE_LIMIT + self->reach);
  if (clearance > self->reach + BODY_LOOK_AHEAD) {
    near->slack = clearance - self->reach;
    return;
  }
  near->slack = BODY_LOOK_AHEAD;
  const double reach = self->reach + BODY_LOOK_AHEAD;
  const size_t edges = arena_edges_near(where, near->x, near->y, reach, near->edges, BODY_EDGES_CAPACITY);
  const size_t discs = arena_discs_near(where, near->x, near->y, reach, near->discs, BODY_DISCS_CAPACITY);
  near->edge_count = (uint16_t)(edges > BODY_EDGES_CAPACITY ? BODY_EDGES_CAPACITY + 1 : edges);
  near->disc_count = (uint16_t)(discs > BODY_DISCS_CAPACITY ? BODY_DISCS_CAPACITY + 1 : discs);
}

const uint32_t *body_near_edges(const body *self, const arena *where, size_t *count) {
  const int all = self->near.edge_count > BODY_EDGES_CAPACITY;
  *count = all ? arena_edge_count(where) : self->near.edge_count;
  return all ? NULL : self->near.edges;
}

const uint32_t *body_near_discs(const body *self, const arena *where, size_t *count) {
  const int all = self->near.disc_count > BODY_DISCS_CAPACITY;
  *count = all ? arena_disc_count(where) : self->near.disc_count;
  return all ? NULL : self->near.discs;
}

static int mover_meets_segment(const mover *m, double ax, double ay, double bx, double by) {
  if (m->outline == NULL) {
    const arena_disc disc = {.x = m->x, .y = m->y, .radius = m->radius};
    return arena_disc_meets_segment(&disc, ax, ay, bx, by);
  }
  const double px = (ax - m->x) * m->cosine + (ay - m->y) * m->sine; /* in the mover's frame */
  const double py = (ay - m->y) * m->cosine - (ax - m->x) * m->sine;
  const double qx = (bx - m->x) * m->cosine + (by - m->y) * m->sine;
  const double qy = (by - m->y) * m->cosine - (bx - m->x) * m->sine;
  for (size_t i = 0; i < m->corners; i++) {
    const double *a = m->outline + 2 * i;
    const double *b = m->outline + 2 * (i + 1 < m->corners ? i + 1 : 0);
    arena_edge e = {.ax = a[0], .ay = a[1], .ex = b[0] - a[0], .ey = b[1] - a[1]};
    e.length_squared = e.ex * e.ex + e.ey * e.ey;
    if (arena_edge_meets_segment(&e, px, py, qx, qy)) return 1;
  }
  return 0;
}

int body_segment_touches(body *self, const scene *around, double x0, double y0, double x1, double y1, double height) {
  const arena *where = around->arena;
  const int clear = body_is_clear(self, where);
  if (clear && around->movers_count == 0) return 0;
  const body_state *s = &self->state;
  const double ax = s->x + x0 * s->cosine - y0 * s->sine;
  const double ay = s->y + x0 * s->sine + y0 * s->cosine;
  const double bx = s->x + x1 * s->cosine - y1 * s->sine;
  const double by = s->y + x1 * s->sine + y1 * s->cosine;
  size_t count;
  const uint32_t *list = body_near_edges(self, where, &count);
  for (size_t i = 0; i < count; i++) {
    const arena_edge *edge = &arena_edges(where)[list != NULL ? list[i] : i];
    if (edge->height >= height && arena_edge_meets_segment(edge, ax, ay, bx, by)) return 1;
  }
  list = body_near_discs(self, where, &count);
  for (size_t i = 0; i < count; i++) {
    const arena_disc *disc = &arena_discs(where)[list != NULL ? list[i] : i];
    if (disc->height >= height && arena_disc_meets_segment(disc, ax, ay, bx, by)) return 1;
  }
  for (size_t i = 0; i < around->movers_count; i++) {
    const mover *m = &around->movers[i];
    if ((m->id == self->id && self->id != 0) || m->height < height) continue;
    const double reach = m->radius + self->reach;
    if ((m->x - s->x) * (m->x - s->x) + (m->y - s->y) * (m->y - s->y) > reach * reach) continue;
    if (mover_meets_segment(m, ax, ay, bx, by)) return 1;
  }
  return 0;
}
