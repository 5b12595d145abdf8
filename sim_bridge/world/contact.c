/* contact.c: see contact.h. What a body meets, and where. */
#include "contact.h"

#include <math.h>

#include "geometry/numbers.h"

/* What is met: everything within `rounding` of a segment, moving. */
typedef struct {
  double ax, ay, bx, by;
  double rounding;
  int one_end; /* 1: the other end belongs to the next segment as well */
  body *other;
  mover *pusher;
  double x, y, vx, vy, turn_rate; /* of what it belongs to, if that does not give way */
} capsule;

static const double CENTRE[2] = {0.0, 0.0};

static size_t core_of(const body *self, const double **core, double *rounding) {
  const body_outline *outline = self->parameters.outline;
  *core = outline != NULL ? outline->core : CENTRE;
  *rounding = outline != NULL ? outline->rounding : self->parameters.radius;
  return outline != NULL ? outline->corners : 1;
}

/* Where along from a (0) to b (1) a segment is nearest to (x, y). */
NUMBERS_INLINE double nearest_share(double ax, double ay, double bx, double by, double x, double y) {
  const double ex = bx - ax;
  const double ey = by - ay;
  const double squared = ex * ex + ey * ey;
  const double t = (x - ax) * ex + (y - ay) * ey;
  if (!(t > 0.0)) return 0.0;
  return t < squared ? t / squared : 1.0;
}

/* Where one more contact goes: the shallowest of too many gives way. NULL: that is the new one. */
static contact *room_for(contacts *out, double gap) {
  if (out->count < CONTACTS_CAPACITY) return &out->list[out->count++];
  contact *shallowest = &out->list[0];
  for (int i = 1; i < CONTACTS_CAPACITY; i++) {
    if (out->list[i].gap > shallowest->gap) shallowest = &out->list[i];
  }
  return gap < shallowest->gap ? shallowest : NULL;
}

static void add(contacts *out, const body *self, const capsule *c, double px, double py, double qx, double qy,
                double apart, double distance) {
  contact *k = distance > 0.0 ? room_for(out, distance - apart) : NULL;
  if (k == NULL) return;
  const body_state *s = &self->state;
  k->other = c->other;
  k->pusher = c->pusher;
  k->gap = distance - apart;
  k->nx = (px - qx) / distance;
  k->ny = (py - qy) / distance;
  k->px = (px - s->x) * s->cosine + (py - s->y) * s->sine;
  k->py = (py - s->y) * s->cosine - (px - s->x) * s->sine;
  k->apart = apart;
  if (c->other != NULL) {
    const body_state *o = &c->other->state;
    k->qx = (qx - o->x) * o->cosine + (qy - o->y) * o->sine;
    k->qy = (qy - o->y) * o->cosine - (qx - o->x) * o->sine;
    k->vx = k->vy = 0.0;
  } else {
    k->qx = qx;
    k->qy = qy;
    k->vx = c->vx - c->turn_rate * (qy - c->y);
    k->vy = c->vy + c->turn_rate * (qx - c->x);
  }
}

/* Velocity of the point p of the body relative to the point q of what is met. */
NUMBERS_INLINE double velocity_x(const body *self, const capsule *c, double py, double qy) {
  const body_state *s = &self->state;
  const double own = s->speed * s->cosine - s->lateral * s->sine - s->turn_rate * (py - s->y);
  if (c->other == NULL) return own - (c->vx - c->turn_rate * (qy - c->y));
  const body_state *o = &c->other->state;
  return own - (o->speed * o->cosine - o->lateral * o->sine - o->turn_rate * (qy - o->y));
}

NUMBERS_INLINE double velocity_y(const body *self, const capsule *c, double px, double qx) {
  const body_state *s = &self->state;
  const double own = s->speed * s->sine + s->lateral * s->cosine + s->turn_rate * (px - s->x);
  if (c->other == NULL) return own - (c->vy + c->turn_rate * (qx - c->x));
  const body_state *o = &c->other->state;
  return own - (o->speed * o->sine + o->lateral * o->cosine + o->turn_rate * (qx - o->x));
}

/* A pair of points, one of the core, one of the capsule. */
NUMBERS_INLINE void pair(contacts *out, const body *self, const capsule *c, double px, double py, double qx, double qy,
                         double apart, double margin) {
  const double dx = px - qx;
  const double dy = py - qy;
  const double distance = sqrt(dx * dx + dy * dy);
  const double clear = distance - c->rounding;
  if (clear < out->nearest) out->nearest = clear;
  if (distance < apart + margin) add(out, self, c, px, py, qx, qy, apart, distance);
  const double gap = distance - apart;
  if (!(gap > CONTACT_DEPTH)) return;
  const double closing = (velocity_x(self, c, py, qy) * dx + velocity_y(self, c, px, qx) * dy) / distance;
  if (closing < 0.0 && (gap + CONTACT_DEPTH) / -closing < out->first) out->first = (gap + CONTACT_DEPTH) / -closing;
}

/* The point of a capsule's segment nearest to the body's middle. */
NUMBERS_INLINE void nearest_point(const body_state *s, const capsule *c, double *x, double *y) {
  const double t = nearest_share(c->ax, c->ay, c->bx, c->by, s->x, s->y);
  *x = c->ax + t * (c->bx - c->ax);
  *y = c->ay + t * (c->by - c->ay);
}

NUMBERS_INLINE void meet_circle(contacts *out, const body *self, const capsule *c, double margin) {
  const body_state *s = &self->state;
  double mx, my;
  nearest_point(s, c, &mx, &my);
  pair(out, self, c, s->x, s->y, mx, my, self->parameters.radius + c->rounding, margin);
}

static void meet_polygon(contacts *out, const body *self, const capsule *c, double margin) {
  const body_state *s = &self->state;
  const double *core;
  double rounding;
  const size_t n = core_of(self, &core, &rounding);
  const double apart = rounding + c->rounding;
  double mx, my;
  nearest_point(s, c, &mx, &my);
  const double far = sqrt((mx - s->x) * (mx - s->x) + (my - s->y) * (my - s->y)) - self->body_reach - c->rounding;
  if (far > rounding + margin) { /* out of reach */
    if (far < out->nearest) out->nearest = far;
    return;
  }
  double world[2 * BODY_CORNERS_MAXIMUM];
  for (size_t i = 0; i < n; i++) {
    world[2 * i] = s->x + core[2 * i] * s->cosine - core[2 * i + 1] * s->sine;
    world[2 * i + 1] = s->y + core[2 * i] * s->sine + core[2 * i + 1] * s->cosine;
  }
  for (size_t i = 0; i < n; i++) {
    const double *p = world + 2 * i;
    const double *q = world + 2 * (i + 1 < n ? i + 1 : 0);
    const double u = nearest_share(c->ax, c->ay, c->bx, c->by, p[0], p[1]);
    pair(out, self, c, p[0], p[1], c->ax + u * (c->bx - c->ax), c->ay + u * (c->by - c->ay), apart, margin);
    const double v = nearest_share(p[0], p[1], q[0], q[1], c->ax, c->ay);
    if (v > 0.0 && v < 1.0)
      pair(out, self, c, p[0] + v * (q[0] - p[0]), p[1] + v * (q[1] - p[1]), c->ax, c->ay, apart, margin);
    if (c->one_end) continue;
    const double w = nearest_share(p[0], p[1], q[0], q[1], c->bx, c->by);
    if (w > 0.0 && w < 1.0)
      pair(out, self, c, p[0] + w * (q[0] - p[0]), p[1] + w * (q[1] - p[1]), c->bx, c->by, apart, margin);
  }
}

static void meet(contacts *out, const body *self, const capsule *c, double margin) {
  if (self->parameters.outline == NULL) {
    meet_circle(out, self, c, margin);
  } else {
    meet_polygon(out, self, c, margin);
  }
}

/* A ring of points in the frame of a pose: a disc (count 0), a point with rounding (1), or a polygon. */
static void meet_ring(contacts *out, const body *self, capsule *c, const double *xy, size_t count, double x, double y,
                      double cosine, double sine, double margin) {
  if (count <= 1) {
    c->ax = c->bx = x;
    c->ay = c->by = y;
    c->one_end = 1;
    meet(out, self, c, margin);
    return;
  }
  c->one_end = 1;
  double px = x + xy[2 * count - 2] * cosine - xy[2 * count - 1] * sine;
  double py = y + xy[2 * count - 2] * sine + xy[2 * count - 1] * cosine;
  for (size_t i = 0; i < count; i++) {
    c->ax = px;
    c->ay = py;
    px = x + xy[2 * i] * cosine - xy[2 * i + 1] * sine;
    py = y + xy[2 * i] * sine + xy[2 * i + 1] * cosine;
    c->bx = px;
    c->by = py;
    meet(out, self, c, margin);
  }
}

double contact_mover_speed(const mover *self) {
  return sqrt(self->vx * self->vx + self->vy * self->vy) + fabs(self->turn_rate) * self->radius;
}

static void meet_mover(contacts *out, const body *self, mover *m, double elapsed, double margin) {
  const int waits = elapsed >= m->stops;
  const double gone = waits ? m->stops : elapsed;
  const double x = m->x + m->vx * gone;
  const double y = m->y + m->vy * gone;
  const double dx = x - self->state.x;
  const double dy = y - self->state.y;
  const double far = sqrt(dx * dx + dy * dy) - m->radius - self->body_reach;
  if (far > CONTACT_FAR) {
    if (far < out->nearest) out->nearest = far;
    return;
  }
  double turned_s = 0.0;
  double turned_c = 1.0;
  if (m->turn_rate != 0.0 && gone != 0.0) number_sincos(m->turn_rate * gone, &turned_s, &turned_c);
  const double cosine = m->cosine * turned_c - m->sine * turned_s;
  const double sine = m->sine * turned_c + m->cosine * turned_s;
  capsule c = {.rounding = m->outline == NULL ? m->radius : 0.0,
               .pusher = m,
               .x = x,
               .y = y,
               .vx = waits ? 0.0 : m->vx,
               .vy = waits ? 0.0 : m->vy,
               .turn_rate = waits ? 0.0 : m->turn_rate};
  meet_ring(out, self, &c, m->outline, m->outline == NULL ? 0 : m->corners, x, y, cosine, sine, margin);
}

static void clear(contacts *out) {
  out->count = 0;
  out->nearest = out->first = 1e300;
}

void contact_find(body *self, const scene *around, double elapsed, double margin, contacts *out) {
  clear(out);
  body_look_around(self, around->arena, 0.5);
  out->nearest = body_looks_far(self);
  for (size_t i = 0; i < around->movers_count; i++) meet_mover(out, self, &around->movers[i], elapsed, margin);
  const int circle = self->parameters.outline == NULL;
  const arena_edge *edges = arena_edges(around->arena);
  size_t count;
  const uint32_t *list = body_near_edges(self, around->arena, &count);
  for (size_t i = 0; i < count; i++) {
    const arena_edge *e = &edges[list != NULL ? list[i] : i];
    const capsule c = {.ax = e->ax, .ay = e->ay, .bx = e->ax + e->ex, .by = e->ay + e->ey};
    if (circle) {
      meet_circle(out, self, &c, margin);
    } else {
      meet_polygon(out, self, &c, margin);
    }
  }
  const arena_disc *discs = arena_discs(around->arena);
  list = body_near_discs(self, around->arena, &count);
  for (size_t i = 0; i < count; i++) {
    const arena_disc *d = &discs[list != NULL ? list[i] : i];
    const capsule c = {.ax = d->x, .ay = d->y, .bx = d->x, .by = d->y, .rounding = d->radius, .one_end = 1};
    meet(out, self, &c, margin);
  }
}

void contact_find_pair(body *self, body *other, double margin, contacts *out) {
  clear(out);
  const double *core;
  capsule c = {.other = other};
  const size_t n = core_of(other, &core, &c.rounding);
  const body_state *o = &other->state;
  meet_ring(out, self, &c, core, n, o->x, o->y, o->cosine, o->sine, margin);
}
