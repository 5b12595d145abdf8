/* contact_move.c: see contact.h. What contacts do: impulses, and places. */
#include <math.h>

#include "contact.h"
#include "numbers.h"

#define ROUNDS 100
#define DEPTH_LIMIT 5e-7           /* m: deeper than this after all rounds there is no place */
#define CORE_SHARE 0.5             /* a core that came nearer than this share of the rounding is treated as that far */
#define PART_LEAST (1.0 / 65536.0) /* of a step: 16 m of it at a rounding of 1 mm */
#define MEETINGS_MAXIMUM 64        /* after so many parts of a step its meetings are not awaited one by one */

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
  const double spin = p->slip ? 0.0 : self->spin; /* a blow is too short for tyres to pass it on to the wheels */
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
    if (depth < -CONTACT_DEPTH) continue;
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

static void note_touch(body *self, double x, double y) {
  self->state.touching = 1;
  self->state.touch_x = x;
  self->state.touch_y = y;
}

/* Half of how far the fastest may go, and the time of the first meeting. */
typedef struct {
  double nearest, fastest, first;
} outlook;

static void consider(outlook *all, const body *self, const contacts *found) {
  const body_outline *outline = self->parameters.outline;
  const double rounding = outline != NULL ? outline->rounding : self->parameters.radius;
  const double nearest = fmax(found->nearest, CORE_SHARE * rounding);
  if (nearest < all->nearest) all->nearest = nearest;
  if (found->first < all->first) all->first = found->first;
}

/* Notes who touches, and returns how long the bodies may move: until a core could pass something, or to the instant of
 * the first meeting, so that its impulse acts where it should. */
static double look(body *const bodies[], size_t count, const scene *around, double elapsed, double remaining,
                   int meetings) {
  contacts found;
  outlook all = {.nearest = 1e300, .first = 1e300};
  for (size_t i = 0; i < count; i++) {
    body *b = bodies[i];
    const body_state *s = &b->state;
    contact_find(b, around, elapsed, BODY_SKIN, &found);
    if (found.count > 0) note_touch(b, found.list[0].qx, found.list[0].qy);
    consider(&all, b, &found);
    const double turning = b->parameters.outline != NULL ? fabs(s->turn_rate) * b->body_reach : 0.0;
    const double own = sqrt(s->speed * s->speed + s->lateral * s->lateral) + turning;
    if (own > all.fastest) all.fastest = own;
    for (size_t k = 0; k < i; k++) {
      if (!are_near(b, bodies[k], CONTACT_FAR)) {
        if (all.nearest > CONTACT_FAR) all.nearest = CONTACT_FAR;
        continue;
      }
      contact_find_pair(b, bodies[k], BODY_SKIN, &found);
      consider(&all, b, &found);
      if (found.count == 0) continue;
      const situation now = situation_of(b, &found.list[0]);
      const body_state *o = &bodies[k]->state;
      note_touch(b, o->x + now.ox, o->y + now.oy);
      note_touch(bodies[k], o->x + now.ox, o->y + now.oy);
    }
  }
  double mover_fastest = 0.0;
  for (size_t i = 0; i < around->movers_count; i++) {
    mover_fastest = fmax(mover_fastest, contact_mover_speed(&around->movers[i]));
  }
  const double rate = (count > 1 ? 2.0 : 1.0) * all.fastest + mover_fastest;
  double part = rate * remaining > 0.5 * all.nearest ? 0.5 * all.nearest / rate : remaining;
  if (meetings && all.first < part) part = all.first;
  return part < remaining ? part : remaining;
}

/* Returns 0 where no place was found. */
static int move_part(body *const bodies[], size_t count, const scene *around, double elapsed, double dt) {
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
      contact_find(bodies[i], around, elapsed + dt, CONTACT_DEPTH, &found);
      if (found.count > 0) deepest = fmax(deepest, put_out(bodies[i], &found));
      for (size_t k = 0; k < i; k++) {
        if (!are_near(bodies[i], bodies[k], BODY_SKIN)) continue;
        contact_find_pair(bodies[i], bodies[k], CONTACT_DEPTH, &found);
        if (found.count > 0) deepest = fmax(deepest, put_out(bodies[i], &found));
      }
    }
    if (deepest < CONTACT_DEPTH) return 1;
  }
  if (deepest < DEPTH_LIMIT) return 1;
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
  return 0;
}

void contact_move(body *const bodies[], size_t count, const scene *around, double dt) {
  double elapsed = 0.0;
  for (int parts = 0; elapsed < dt; parts++) {
    const double left = dt - elapsed;
    double part = look(bodies, count, around, elapsed, left, parts < MEETINGS_MAXIMUM);
    if (part < PART_LEAST * dt) part = PART_LEAST * dt < left ? PART_LEAST * dt : left;
    const int found = move_part(bodies, count, around, elapsed, part);
    if (!found && around->movers_count == 0) break; /* at rest, and nothing comes to change that */
    elapsed = part >= left ? dt : elapsed + part;
  }
  for (size_t i = 0; i < count; i++) bodies[i]->state.touching = 0;
  look(bodies, count, around, dt, 0.0, 0);
}
