/* contact.c: see contact.h. */
#include "contact.h"

#include <math.h>

#include "numbers.h"

#define ROUNDS 100
#define DEPTH_LIMIT 5e-7 /* m: deeper than this after all rounds there is no place */
#define PARTS_MAXIMUM 4096.0

/* What is met: everything within `rounding` of a segment, moving. */
typedef struct {
  double ax, ay, bx, by;
  double rounding;
  int one_end; /* 1: the other end belongs to the next segment as well */
  body *other;
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
static double nearest_share(double ax, double ay, double bx, double by, double x, double y) {
  const double ex = bx - ax;
  const double ey = by - ay;
  const double squared = ex * ex + ey * ey;
  const double t = (x - ax) * ex + (y - ay) * ey;
  if (!(t > 0.0)) return 0.0;
  return t < squared ? t / squared : 1.0;
}

static void add(contacts *out, const body *self, const capsule *c, double px, double py, double qx, double qy,
                double apart, double distance) {
  if (out->count == CONTACTS_CAPACITY || distance <= 0.0) return;
  const body_state *s = &self->state;
  contact *k = &out->list[out->count++];
  k->other = c->other;
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

/* A pair of points, one of the core, one of the capsule. */
static void pair(contacts *out, const body *self, const capsule *c, double px, double py, double qx, double qy,
                 double apart, double margin) {
  const double dx = px - qx;
  const double dy = py - qy;
  const double distance = sqrt(dx * dx + dy * dy);
  const double clear = distance - c->rounding;
  if (clear < out->nearest) out->nearest = clear;
  if (distance < apart + margin) add(out, self, c, px, py, qx, qy, apart, distance);
}

static void meet(contacts *out, const body *self, const capsule *c, double margin) {
  const body_state *s = &self->state;
  const double *core;
  double rounding;
  const size_t n = core_of(self, &core, &rounding);
  const double apart = rounding + c->rounding;
  const double t = nearest_share(c->ax, c->ay, c->bx, c->by, s->x, s->y);
  const double mx = c->ax + t * (c->bx - c->ax);
  const double my = c->ay + t * (c->by - c->ay);
  if (n == 1) {
    pair(out, self, c, s->x, s->y, mx, my, apart, margin);
    return;
  }
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

static void meet_mover(contacts *out, const body *self, const mover *m, double elapsed, double margin) {
  const double x = m->x + m->vx * elapsed;
  const double y = m->y + m->vy * elapsed;
  const double dx = x - self->state.x;
  const double dy = y - self->state.y;
  const double far = sqrt(dx * dx + dy * dy) - m->radius - self->body_reach;
  if (far > 0.1) {
    if (far < out->nearest) out->nearest = far;
    return;
  }
  double turned_s = 0.0;
  double turned_c = 1.0;
  if (m->turn_rate != 0.0 && elapsed != 0.0) number_sincos(m->turn_rate * elapsed, &turned_s, &turned_c);
  const double cosine = m->cosine * turned_c - m->sine * turned_s;
  const double sine = m->sine * turned_c + m->cosine * turned_s;
  capsule c = {.rounding = m->outline == NULL ? m->radius : 0.0,
               .x = x,
               .y = y,
               .vx = m->vx,
               .vy = m->vy,
               .turn_rate = m->turn_rate};
  meet_ring(out, self, &c, m->outline, m->outline == NULL ? 0 : m->corners, x, y, cosine, sine, margin);
}

static void clear(contacts *out) {
  out->count = 0;
  out->nearest = 1e300;
}

void contact_find(body *self, const scene *around, double elapsed, double margin, contacts *out) {
  clear(out);
  body_look_around(self, around->arena, 0.5);
  const body_surroundings *near = &self->near;
  const double dx = self->state.x - near->x;
  const double dy = self->state.y - near->y;
  out->nearest = near->slack - sqrt(dx * dx + dy * dy); /* what is not in the list is farther than this */
  const arena_edge *edges = arena_edges(around->arena);
  size_t count;
  const uint32_t *list = body_near_edges(self, around->arena, &count);
  for (size_t i = 0; i < count; i++) {
    const arena_edge *e = &edges[list != NULL ? list[i] : i];
    const capsule c = {.ax = e->ax, .ay = e->ay, .bx = e->ax + e->ex, .by = e->ay + e->ey};
    meet(out, self, &c, margin);
  }
  const arena_disc *discs = arena_discs(around->arena);
  list = body_near_discs(self, around->arena, &count);
  for (size_t i = 0; i < count; i++) {
    const arena_disc *d = &discs[list != NULL ? list[i] : i];
    const capsule c = {.ax = d->x, .ay = d->y, .bx = d->x, .by = d->y, .rounding = d->radius, .one_end = 1};
    meet(out, self, &c, margin);
  }
  for (size_t i = 0; i < around->movers_count; i++) meet_mover(out, self, &around->movers[i], elapsed, margin);
}

/* Contacts of one robot with another. */
static void find_pair(body *self, body *other, double margin, contacts *out) {
  clear(out);
  const double *core;
  capsule c = {.other = other};
  const size_t n = core_of(other, &core, &c.rounding);
  const body_state *o = &other->state;
  meet_ring(out, self, &c, core, n, o->x, o->y, o->cosine, o->sine, margin);
}

/* ---- impulses and places ------------------------------------------------------------------------------------------ */

/* What a unit impulse along (nx, ny) at (rx, ry) from the middle does to a body. */
typedef struct {
  double speed, lateral, turn_rate; /* changes */
  double along, across, moment;     /* components of the impulse */
  double gain;                      /* change of the velocity along the impulse: 1 / the mass felt there */
} answer;

static answer answer_of(const body *self, double nx, double ny, double rx, double ry) {
  const body_state *s = &self->state;
  const body_parameters *p = &self->parameters;
  const double spin = s->slipping ? 0.0 : (p->slip ? self->slip_spin : self->spin); /* wheels that roll turn with it */
  answer a = {.along = nx * s->cosine + ny * s->sine, .across = ny * s->cosine - nx * s->sine};
  a.moment = rx * ny - ry * nx;
  a.speed = a.along / (self->mass + 2.0 * spin);
  a.lateral = a.across / self->mass;
  a.turn_rate = a.moment / (self->inertia + 2.0 * p->half_track * p->half_track * spin);
  a.gain = a.along * a.speed + a.across * a.lateral + a.moment * a.turn_rate;
  return a;
}

static double velocity_along(const body *self, const answer *a) {
  const body_state *s = &self->state;
  return s->speed * a->along + s->lateral * a->across + s->turn_rate * a->moment;
}

static void push(body *self, const answer *a, double impulse) {
  body_state *s = &self->state;
  if (self->parameters.slip && !s->slipping) {
    s->speed += impulse * a->speed;
    s->turn_rate += impulse * a->turn_rate;
    s->rim_left = body_left_speed(self);
    s->rim_right = body_right_speed(self);
    s->slipping = impulse * a->lateral != 0.0; /* it rolls on unless it was pushed sideways */
  } else {
    s->speed += impulse * a->speed;
    s->turn_rate += impulse * a->turn_rate;
  }
  s->lateral += impulse * a->lateral;
}

void contact_turn(body *self, double angle) {
  body_state *s = &self->state;
  const double cosine = s->cosine;
  const double sine = s->sine;
  s->heading = number_wrap(s->heading + angle);
  number_sincos(s->heading, &s->sine, &s->cosine);
  if (!s->slipping) return;
  const double c = cosine * s->cosine + sine * s->sine;
  const double d = cosine * s->sine - sine * s->cosine;
  const double speed = s->speed;
  s->speed = speed * c + s->lateral * d;
  s->lateral = s->lateral * c - speed * d;
}

/* A contact with the poses of now. */
typedef struct {
  double rx, ry; /* from the body's middle to the point, in the arena's frame */
  double ox, oy; /* from the other body's middle */
  double gap;
} situation;

static situation situation_of(const body *self, const contact *k) {
  const body_state *s = &self->state;
  situation now = {.rx = k->px * s->cosine - k->py * s->sine, .ry = k->px * s->sine + k->py * s->cosine};
  double qx = k->qx;
  double qy = k->qy;
  if (k->other != NULL) {
    const body_state *o = &k->other->state;
    now.ox = k->qx * o->cosine - k->qy * o->sine;
    now.oy = k->qx * o->sine + k->qy * o->cosine;
    qx = o->x + now.ox;
    qy = o->y + now.oy;
  }
  now.gap = (s->x + now.rx - qx) * k->nx + (s->y + now.ry - qy) * k->ny - k->apart;
  return now;
}

/* Takes away the velocity into one contact beyond `allowed`. The impulse acts where the bodies touch: on the surface. */
static double stop(body *self, const contact *k, const situation *now, double allowed) {
  const answer a = answer_of(self, k->nx, k->ny, now->rx, now->ry);
  answer b = {0};
  double into = velocity_along(self, &a) - (k->vx * k->nx + k->vy * k->ny);
  if (k->other != NULL) {
    b = answer_of(k->other, k->nx, k->ny, now->ox, now->oy);
    into -= velocity_along(k->other, &b);
  }
  if (into >= -allowed) return 0.0;
  const double impulse = -(into + allowed) / (a.gain + b.gain);
  push(self, &a, impulse);
  if (k->other != NULL) push(k->other, &b, -impulse);
  return -(into + allowed);
}

double contact_stop(body *self, const contacts *at, double within) {
  double most = 0.0;
  for (int i = 0; i < at->count; i++) {
    const situation now = situation_of(self, &at->list[i]);
    const double change = stop(self, &at->list[i], &now, now.gap > 0.0 ? now.gap / within : 0.0);
    if (change > most) most = change;
  }
  return most;
}

/* Puts the body out of what it has entered, and takes away its velocity into it. Returns the greatest depth. */
static double put_out(body *self, const contacts *at) {
  double deepest = 0.0;
  for (int i = 0; i < at->count; i++) {
    const contact *k = &at->list[i];
    const situation now = situation_of(self, k);
    const double depth = -now.gap;
    if (depth > deepest) deepest = depth;
    if (depth < 0.0) continue;
    stop(self, k, &now, 0.0);
    if (depth < CONTACT_DEPTH) continue;
    const double lever = now.rx * k->ny - now.ry * k->nx;
    const double other_lever = now.ox * k->ny - now.oy * k->nx;
    const int both = k->other != NULL;
    const double gain = 1.0 / self->mass + lever * lever / self->inertia +
                        (both ? 1.0 / k->other->mass + other_lever * other_lever / k->other->inertia : 0.0);
    const double share = depth / gain;
    self->state.x += share / self->mass * k->nx;
    self->state.y += share / self->mass * k->ny;
    if (lever != 0.0 && self->parameters.outline != NULL) contact_turn(self, share * lever / self->inertia);
    if (!both) continue;
    k->other->state.x -= share / k->other->mass * k->nx;
    k->other->state.y -= share / k->other->mass * k->ny;
    if (other_lever != 0.0 && k->other->parameters.outline != NULL)
      contact_turn(k->other, -share * other_lever / k->other->inertia);
  }
  return deepest;
}

/* ---- moving -------------------------------------------------------------------------------------------------------- */

static int are_near(const body *a, const body *b, double margin) {
  const double dx = a->state.x - b->state.x;
  const double dy = a->state.y - b->state.y;
  const double reach = a->body_reach + b->body_reach + margin;
  return dx * dx + dy * dy < reach * reach;
}

/* Notes who touches, and returns how long the bodies may move before a core could pass something. */
static double look(body *const bodies[], size_t count, const scene *around, double elapsed, double remaining) {
  contacts found;
  double fastest = 0.0;
  double nearest = 1e300;
  for (size_t i = 0; i < count; i++) {
    body *b = bodies[i];
    body_state *s = &b->state;
    contact_find(b, around, elapsed, BODY_SKIN, &found);
    if (found.count > 0) {
      const contact *k = &found.list[0];
      s->touching = 1;
      s->touch_x = k->qx;
      s->touch_y = k->qy;
    }
    if (found.nearest < nearest) nearest = found.nearest;
    const double turning = b->parameters.outline != NULL ? fabs(s->turn_rate) * b->body_reach : 0.0;
    const double own = sqrt(s->speed * s->speed + s->lateral * s->lateral) + turning;
    if (own > fastest) fastest = own;
    for (size_t k = 0; k < i; k++) {
      if (!are_near(b, bodies[k], 0.1)) { /* farther apart than a core may go in a part */
        if (nearest > 0.1) nearest = 0.1;
        continue;
      }
      find_pair(b, bodies[k], BODY_SKIN, &found);
      if (found.nearest < nearest) nearest = found.nearest;
      if (found.count == 0) continue;
      const situation now = situation_of(b, &found.list[0]);
      s->touching = bodies[k]->state.touching = 1;
      s->touch_x = bodies[k]->state.touch_x = bodies[k]->state.x + now.ox;
      s->touch_y = bodies[k]->state.touch_y = bodies[k]->state.y + now.oy;
    }
  }
  if (count > 1) fastest *= 2.0;
  double mover_fastest = 0.0;
  for (size_t i = 0; i < around->movers_count; i++) {
    const double speed = contact_mover_speed(&around->movers[i]);
    if (speed > mover_fastest) mover_fastest = speed;
  }
  const double rate = fastest + mover_fastest;
  return rate * remaining > 0.5 * nearest ? 0.5 * nearest / rate : remaining;
}

static void move_part(body *const bodies[], size_t count, const scene *around, double elapsed, double dt) {
  struct {
    double x, y, heading, cosine, sine;
  } before[BODY_MAXIMUM];
  contacts found;
  for (size_t i = 0; i < count; i++) {
    body_state *s = &bodies[i]->state;
    if (bodies[i]->parameters.outline == NULL) contact_turn(bodies[i], s->turn_rate * dt); /* never in the way */
    before[i].x = s->x;
    before[i].y = s->y;
    before[i].heading = s->heading;
    before[i].cosine = s->cosine;
    before[i].sine = s->sine;
    if (bodies[i]->parameters.outline != NULL) contact_turn(bodies[i], s->turn_rate * dt); /* (3.18) */
    s->x += (s->speed * s->cosine - s->lateral * s->sine) * dt;                            /* (3.19)-(3.22) */
    s->y += (s->speed * s->sine + s->lateral * s->cosine) * dt;
  }
  double deepest = 0.0;
  for (int round = 0; round < ROUNDS; round++) {
    deepest = 0.0;
    for (size_t i = 0; i < count; i++) {
      contact_find(bodies[i], around, elapsed + dt, 0.0, &found);
      if (found.count > 0) deepest = fmax(deepest, put_out(bodies[i], &found));
      for (size_t k = 0; k < i; k++) {
        if (!are_near(bodies[i], bodies[k], 0.0)) continue;
        find_pair(bodies[i], bodies[k], 0.0, &found);
        if (found.count > 0) deepest = fmax(deepest, put_out(bodies[i], &found));
      }
    }
    if (deepest < CONTACT_DEPTH) return;
  }
  if (deepest < DEPTH_LIMIT) return;
  for (size_t i = 0; i < count; i++) {
    body_state *s = &bodies[i]->state;
    s->x = before[i].x;
    s->y = before[i].y;
    s->heading = before[i].heading;
    s->cosine = before[i].cosine;
    s->sine = before[i].sine;
    s->speed = s->lateral = 0.0;
    if (bodies[i]->parameters.outline != NULL) s->turn_rate = 0.0;
  }
}

void contact_move(body *const bodies[], size_t count, const scene *around, double dt) {
  double elapsed = 0.0;
  while (elapsed < dt) {
    double part = look(bodies, count, around, elapsed, dt - elapsed);
    if (part < dt / PARTS_MAXIMUM) part = dt / PARTS_MAXIMUM;
    const double left = dt - elapsed;
    if (part >= left) part = left;
    move_part(bodies, count, around, elapsed, part);
    elapsed = part >= left ? dt : elapsed + part;
  }
  for (size_t i = 0; i < count; i++) bodies[i]->state.touching = 0;
  look(bodies, count, around, dt, 0.0);
}
