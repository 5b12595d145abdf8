/* contact_move.c: see contact.h. What contacts do: impulses, and places. */
#include <math.h>

#include "contact.h"
#include "geometry/numbers.h"

#define ROUNDS 100
#define DEPTH_LIMIT 5e-7           /* m: deeper than this after all rounds there is no place */
#define CORE_SHARE 0.5             /* a core that came nearer than this share of the rounding is treated as that far */
#define PART_LEAST (1.0 / 65536.0) /* of a step: 16 m of it at a rounding of 1 mm, 0.25 m at 15 um */
#define HALVINGS 8                 /* of a part in which a body would be pushed too far */
#define MEETINGS_MAXIMUM 64        /* parts of a step; beyond them its meetings are not awaited one by one */

/* ---- impulses and places ------------------------------------------------------------------------------------------ */

/* Of a unit impulse along (nx, ny) at (rx, ry) from the middle. */
static contact_answer answer_of(const body *self, double nx, double ny, double rx, double ry) {
  const body_state *s = &self->state;
  const body_parameters *p = &self->parameters;
  const double spin = p->slip ? 0.0 : self->spin; /* a blow is too short for tyres to pass it on to the wheels */
  contact_answer a = {.along = nx * s->cosine + ny * s->sine, .across = ny * s->cosine - nx * s->sine};
  a.moment = rx * ny - ry * nx;
  a.speed = a.along / (self->mass + 2.0 * spin);
  a.lateral = a.across / self->mass;
  a.turn_rate = a.moment / (self->inertia + 2.0 * p->half_track * p->half_track * spin);
  a.gain = a.along * a.speed + a.across * a.lateral + a.moment * a.turn_rate;
  return a;
}

NUMBERS_INLINE double velocity_along(const body *self, const contact_answer *a) {
  const body_state *s = &self->state;
  return s->speed * a->along + s->lateral * a->across + s->turn_rate * a->moment;
}

NUMBERS_INLINE void push(body *self, const contact_answer *a, double impulse) {
  body_state *s = &self->state;
  if (self->parameters.slip && !s->slipping) {
    s->rim_left = body_left_speed(self);
    s->rim_right = body_right_speed(self);
    s->slipping = 1;
  }
  s->speed += impulse * a->speed;
  s->turn_rate += impulse * a->turn_rate;
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

static contact_hold hold_of(const body *self, const contact *k, const situation *now, double allowed) {
  contact_hold h = {.other = k->other, .met = k->vx * k->nx + k->vy * k->ny, .allowed = allowed};
  h.own = answer_of(self, k->nx, k->ny, now->rx, now->ry);
  if (k->other != NULL) h.its = answer_of(k->other, k->nx, k->ny, now->ox, now->oy);
  return h;
}

/* Takes away the velocity into one contact beyond what is allowed. The impulse acts where the bodies touch: on the
 * surface. */
NUMBERS_INLINE double stop(body *self, const contact_hold *h) {
  double into = velocity_along(self, &h->own) - h->met;
  if (h->other != NULL) into -= velocity_along(h->other, &h->its);
  if (into >= -h->allowed) return 0.0;
  const double impulse = -(into + h->allowed) / (h->own.gain + h->its.gain);
  push(self, &h->own, impulse);
  if (h->other != NULL) push(h->other, &h->its, -impulse);
  return -(into + h->allowed);
}

void contact_lean(body *self, const scene *around, double within, contact_holds *out) {
  contacts at;
  out->count = 0;
  if (!self->state.touching) return;
  contact_find(self, around, 0.0, BODY_SKIN, &at);
  for (int i = 0; i < at.count; i++) {
    const situation now = situation_of(self, &at.list[i]);
    out->list[out->count++] = hold_of(self, &at.list[i], &now, now.gap > 0.0 ? now.gap / within : 0.0);
  }
}

double contact_stop(body *self, const contact_holds *at) {
  double most = 0.0;
  for (int i = 0; i < at->count; i++) {
    const double change = stop(self, &at->list[i]);
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
    if (depth < -CONTACT_DEPTH) continue;
    const contact_hold h = hold_of(self, k, &now, 0.0);
    stop(self, &h);
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

static void note_touch(body *self, double x, double y) {
  self->state.touching = 1;
  self->state.touch_x = x;
  self->state.touch_y = y;
}

/* Bodies that could meet within a step, and what is around them. */
typedef struct {
  body *const *bodies;
  size_t count;
  const scene *around;
} group;

/* What lies ahead of a group: the least distance of a core from anything, the least gap, how fast two things near each
 * other at most come closer, and the time of the first meeting. */
typedef struct {
  double nearest, gap, rate, first;
  int sunk; /* 1: a core is nearer than that to something, by nobody's motion */
} outlook;

static void consider(outlook *all, const body *self, const contacts *found) {
  const body_outline *outline = self->parameters.outline;
  const double rounding = outline != NULL ? outline->rounding : self->parameters.radius;
  const double nearest = fmax(found->nearest, CORE_SHARE * rounding);
  if (found->nearest < nearest) all->sunk = 1;
  if (nearest < all->nearest) all->nearest = nearest;
  if (found->nearest - rounding < all->gap) all->gap = found->nearest - rounding;
  if (found->first < all->first) all->first = found->first;
}

static void consider_pair(outlook *all, body *self, body *other) {
  contacts found;
  if (!are_near(self, other, CONTACT_FAR)) {
    if (all->nearest > CONTACT_FAR) all->nearest = CONTACT_FAR;
    if (all->gap > CONTACT_FAR) all->gap = CONTACT_FAR;
    return;
  }
  contact_find_pair(self, other, BODY_SKIN, &found);
  consider(all, self, &found);
  if (found.count == 0) return;
  const situation now = situation_of(self, &found.list[0]);
  note_touch(self, other->state.x + now.ox, other->state.y + now.oy);
  note_touch(other, other->state.x + now.ox, other->state.y + now.oy);
}

/* The fastest that a mover moves which does not wait, m/s. */
static double fastest_mover(const scene *around, double elapsed) {
  double fastest = 0.0;
  for (size_t i = 0; i < around->movers_count; i++) {
    const mover *m = &around->movers[i];
    if (elapsed < m->stops) fastest = fmax(fastest, contact_mover_speed(m));
  }
  return fastest;
}

/* How much closer two things come when each body moves by at most `way` and each mover by at most `mover_way`. */
static double closer(size_t count, double way, double mover_way) { return (count > 1 ? 2.0 : 1.0) * way + mover_way; }

/* Looks ahead, and notes who touches. */
static outlook look(const group *g, double elapsed) {
  contacts found;
  outlook all = {.nearest = 1e300, .gap = 1e300, .first = 1e300};
  double fastest = 0.0;
  for (size_t i = 0; i < g->count; i++) {
    body *b = g->bodies[i];
    const body_state *s = &b->state;
    contact_find(b, g->around, elapsed, BODY_SKIN, &found);
    if (found.count > 0) note_touch(b, found.list[0].qx, found.list[0].qy);
    consider(&all, b, &found);
    const double own = body_core_way(b, sqrt(s->speed * s->speed + s->lateral * s->lateral), s->turn_rate);
    if (own > fastest) fastest = own;
    for (size_t k = 0; k < i; k++) consider_pair(&all, b, g->bodies[k]);
  }
  all.rate = closer(g->count, fastest, fastest_mover(g->around, elapsed));
  return all;
}

/* How long the bodies may move: until a core could pass something, or to the instant of the first meeting, so that its
 * impulse acts where it should. */
static double part_of(const outlook *all, double remaining, int meetings) {
  double part = all->rate * remaining > 0.5 * all->nearest ? 0.5 * all->nearest / all->rate : remaining;
  if (meetings && all->first < part) part = all->first;
  return part < remaining ? part : remaining;
}

/* 1 if for certain nothing touches after a part. */
static int stays_apart(const outlook *ahead, double part) { return ahead->rate * part < ahead->gap - 2.0 * BODY_SKIN; }

/* Where a body would get to if nothing were in the way, and by how far a way. */
typedef struct {
  double x, y, way;
} course;

static void advance(const group *g, double dt, course free[]) {
  for (size_t i = 0; i < g->count; i++) {
    body_state *s = &g->bodies[i]->state;
    free[i].way = body_way(g->bodies[i], dt);
    contact_turn(g->bodies[i], s->turn_rate * dt);              /* (3.18) */
    s->x += (s->speed * s->cosine - s->lateral * s->sine) * dt; /* (3.19)-(3.22) */
    s->y += (s->speed * s->sine + s->lateral * s->cosine) * dt;
    free[i].x = s->x;
    free[i].y = s->y;
  }
}

static int is_on_course(const body_state *s, const course *free) { return s->x == free->x && s->y == free->y; }

/* One round of putting out. Returns the greatest depth met. */
static double put_all_out(const group *g, double elapsed) {
  contacts found;
  double deepest = 0.0;
  for (size_t i = 0; i < g->count; i++) {
    contact_find(g->bodies[i], g->around, elapsed, CONTACT_DEPTH, &found);
    if (found.count > 0) deepest = fmax(deepest, put_out(g->bodies[i], &found));
    for (size_t k = 0; k < i; k++) {
      if (!are_near(g->bodies[i], g->bodies[k], BODY_SKIN)) continue;
      contact_find_pair(g->bodies[i], g->bodies[k], CONTACT_DEPTH, &found);
      if (found.count > 0) deepest = fmax(deepest, put_out(g->bodies[i], &found));
    }
  }
  return deepest;
}

/* 1 if no body is deeper than the limit in anything. */
static int is_good(const group *g, double elapsed) {
  contacts found;
  for (size_t i = 0; i < g->count; i++) {
    contact_find(g->bodies[i], g->around, elapsed, -DEPTH_LIMIT, &found);
    for (size_t k = 0; k < i && found.count == 0; k++)
      contact_find_pair(g->bodies[i], g->bodies[k], -DEPTH_LIMIT, &found);
    if (found.count > 0) return 0;
  }
  return 1;
}

/* Returns 1 where a good place was found for all. */
static int settle(const group *g, double elapsed) {
  for (int round = 0; round < ROUNDS; round++) {
    if (put_all_out(g, elapsed) < CONTACT_DEPTH) return 1;
  }
  return is_good(g, elapsed);
}

/* Movers that at `elapsed` are too deep in a body have waited since `since`. Returns how many do from now on. */
static int stop_movers(const group *g, double elapsed, double since) {
  contacts found;
  int stopped = 0;
  for (size_t i = 0; i < g->count; i++) {
    contact_find(g->bodies[i], g->around, elapsed, -DEPTH_LIMIT, &found);
    for (int k = 0; k < found.count; k++) {
      mover *m = found.list[k].pusher;
      if (m == NULL || m->stops <= since) continue;
      m->stops = since;
      stopped++;
    }
  }
  return stopped;
}

static double way_from(const body_state *before, const body_state *now) {
  const double dx = now->x - before->x;
  const double dy = now->y - before->y;
  return sqrt(dx * dx + dy * dy);
}

/* 1 if within the part no core can have passed anything, pushes included. */
static int passed_nothing(const group *g, const body_state before[], const course free[], const outlook *ahead,
                          double elapsed, double part) {
  double most = -1.0;
  for (size_t i = 0; i < g->count; i++) {
    const body_state *s = &g->bodies[i]->state;
    if (is_on_course(s, &free[i])) continue;
    const int turns = g->bodies[i]->parameters.outline != NULL;
    const double angle = turns ? number_wrap(s->heading - before[i].heading) : 0.0;
    most = fmax(most, body_core_way(g->bodies[i], way_from(&before[i], s), angle));
  }
  if (most < 0.0) return ahead->rate * part <= ahead->nearest;
  return fmax(closer(g->count, most, fastest_mover(g->around, elapsed) * part), ahead->rate * part) <= ahead->nearest;
}

static void put_back(const group *g, const body_state before[]) {
  for (size_t i = 0; i < g->count; i++) g->bodies[i]->state = before[i];
}

/* Adds the way of a part: where nothing was in the way, what the speed says, as of a step without contact. */
static void count_way(const group *g, const body_state before[], const course free[]) {
  for (size_t i = 0; i < g->count; i++) {
    body_state *s = &g->bodies[i]->state;
    s->distance += is_on_course(s, &free[i]) ? free[i].way : way_from(&before[i], s);
  }
}

/* The bodies stay for `part` seconds; circles may turn. */
static void stay(const group *g, double part) {
  for (size_t i = 0; i < g->count; i++) {
    body_state *s = &g->bodies[i]->state;
    s->speed = s->lateral = 0.0;
    if (g->bodies[i]->parameters.outline != NULL) s->turn_rate = 0.0;
    contact_turn(g->bodies[i], s->turn_rate * part);
  }
}

/* Moves for at most `part` seconds, and returns for how long. */
static double move_part(const group *g, const outlook *ahead, double elapsed, double part) {
  body_state before[BODY_MAXIMUM];
  course free[BODY_MAXIMUM];
  double now = part;
  int halvings = 0;
  for (size_t i = 0; i < g->count; i++) before[i] = g->bodies[i]->state;
  for (;;) {
    advance(g, now, free);
    const int good = stays_apart(ahead, now) || settle(g, elapsed + now);
    if (good && (ahead->sunk || passed_nothing(g, before, free, ahead, elapsed, now))) {
      count_way(g, before, free);
      return now;
    }
    const int stopped = !good && stop_movers(g, elapsed + now, elapsed) > 0;
    put_back(g, before);
    if (stopped) continue; /* again, with them at rest */
    if (!good || halvings++ == HALVINGS) break;
    now *= 0.5;
  }
  stay(g, part);
  stop_movers(g, elapsed + part, elapsed);
  return part;
}

void contact_move(body *const bodies[], size_t count, const scene *around, double dt) {
  const group g = {bodies, count, around};
  double elapsed = 0.0;
  int apart = 0;
  for (int parts = 0; elapsed < dt; parts++) {
    const double left = dt - elapsed;
    const outlook ahead = look(&g, elapsed);
    const double part = fmax(part_of(&ahead, left, parts < MEETINGS_MAXIMUM), fmin(PART_LEAST * dt, left));
    const double done = move_part(&g, &ahead, elapsed, part);
    elapsed = done >= left ? dt : elapsed + done;
    apart = stays_apart(&ahead, done);
  }
  for (size_t i = 0; i < count; i++) bodies[i]->state.touching = 0;
  if (!apart) look(&g, dt);
}
