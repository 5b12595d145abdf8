/* part.c: see part.h. */
#include "part.h"

#include "geometry/numbers.h"

#define BOUNCES_MAXIMUM 4

void part_join(part *self, const part_operations *op, const part_place *place, const part_pin *pins, int count) {
  self->op = op;
  self->chassis = place->chassis;
  self->noise = place->noise;
  self->overridden = 0;
  self->unplugged = 0;
  self->turret = NULL;
  self->faults = NULL;
  for (int i = 0; i < PART_PINS; i++) {
    self->pins[i] = i < count ? pins[i] : (part_pin){PART_NO_PIN, 0};
    self->level[i] = BOARD_RELEASED;
  }
}

static void put(part *self, uint64_t at, uint8_t pin, uint8_t level) {
  if (at == FAULT_NEVER) return;
  self->chassis->driven[pin] = level;
  self->chassis->board->op->drive(self->chassis->board, at, pin, level);
}

/* Faults from `f` on take the pin when they begin, and give it back at `level`. */
static void queue_holds(part *self, fault *f, uint8_t pin, uint8_t level) {
  for (; f != NULL; f = f->next) {
    if (f->pin != pin) continue;
    f->before = level;
    put(self, f->begin, pin, f->level);
    put(self, f->end, pin, level);
  }
}

static void drive(part *self, uint64_t at, uint8_t pin, uint8_t level) {
  fault *f = self->faults;
  for (; f != NULL && f->begin <= at; f = f->next) {
    if (f->pin != pin || at >= f->end) continue;
    f->fired += level != f->level;
    at = f->end;
  }
  put(self, at, pin, level);
  queue_holds(self, f, pin, level);
}

void part_put(part *self, uint64_t at, uint8_t pin, uint8_t level) {
  if (!self->overridden && !self->unplugged) put(self, at, pin, level);
}

int part_add_fault(part *self, fault *made) {
  if (fault_insert(&self->faults, made) != 0) return -1;
  if (self->op->hold != NULL) self->op->hold(self, made);
  for (int i = 0; i < PART_PINS; i++) {
    if (self->pins[i].pin != made->pin || made->pin == PART_NO_PIN || self->overridden || self->unplugged) continue;
    queue_holds(self, made, made->pin, self->level[i]);
  }
  return 0;
}

void part_drive(part *self, uint64_t at, uint8_t pin, uint8_t level) {
  if (pin >= BOARD_PIN_COUNT) return;
  for (int i = 0; i < PART_PINS; i++) {
    if (self->pins[i].pin == pin) self->level[i] = level;
  }
  if (!self->overridden && !self->unplugged) drive(self, at, pin, level);
}

int part_bounce(part *self, noise_source *noise, uint64_t at, uint8_t level, uint8_t before, double mean_s) {
  const uint8_t pin = self->pins[0].pin;
  part_drive(self, at, pin, level);
  if (mean_s <= 0.0 || !noise->on) return 0;
  double length = -mean_s * number_log(1.0 - noise_next_uniform(noise));
  if (length > 5.0 * mean_s) length = 5.0 * mean_s;
  const int flicks = (int)(noise_next_uniform(noise) * (BOUNCES_MAXIMUM + 1));
  const double share = length * BOARD_CLOCK_HZ / (2.0 * BOUNCES_MAXIMUM);
  double next = (double)at;
  for (int i = 0; i < 2 * flicks; i++) {
    next += 16.0 + share * 2.0 * noise_next_uniform(noise);
    part_drive(self, (uint64_t)next, pin, (i & 1) ? level : before);
  }
  return flicks;
}

void part_show(part *self, int index) {
  const uint64_t now = self->chassis->board->op->now(self->chassis->board);
  const uint8_t pin = self->pins[index].pin;
  if (self->unplugged) {
    put(self, now, pin, BOARD_RELEASED);
    return;
  }
  for (const fault *f = self->faults; f != NULL && f->begin <= now; f = f->next) {
    if (f->pin == pin && now < f->end) put(self, now, pin, f->level);
  }
  drive(self, now, pin, self->level[index]);
}

void part_unplug(part *self, int unplugged) {
  self->unplugged = unplugged;
  for (int i = 0; i < PART_PINS && !self->overridden; i++) {
    if ((self->pins[i].role & PART_DRIVES) && self->pins[i].pin < BOARD_PIN_COUNT) part_show(self, i);
  }
}

void part_weaken(part *self, chassis_wheel *wheel) {
  fault *weak = part_fault(self, FAULT_WEAK, self->chassis->since);
  if (weak == NULL) return;
  weak->fired += wheel->torque != 0.0;
  wheel->torque *= weak->value;
}

double part_light_left(part *self, uint64_t cycle) {
  const fault *dirty = part_fires(self, FAULT_DIRTY, cycle);
  return dirty == NULL ? 1.0 : 1.0 - dirty->value;
}

/* The body that would carry the part, turned about the turret's axis by `angle`, in its place. */
static void turn_view(viewpoint *from, const part_turret *turret, double angle) {
  const double tx = from->x + turret->x * from->cosine - turret->y * from->sine; /* (3.9) */
  const double ty = from->y + turret->x * from->sine + turret->y * from->cosine;
  from->heading += angle;
  number_sincos(from->heading, &from->sine, &from->cosine);
  from->x = tx - (turret->x * from->cosine - turret->y * from->sine);
  from->y = ty - (turret->x * from->sine + turret->y * from->cosine);
}

viewpoint part_view(const part *self, uint64_t cycle) {
  const chassis *c = self->chassis;
  const body_state *s = &c->body->state;
  viewpoint from = {c->around, s->x, s->y, s->heading, s->cosine, s->sine, c->self_id};
  double share = 1.0;
  if (cycle < c->since + c->step_cycles) {
    share = cycle > c->since ? (double)(cycle - c->since) / (double)c->step_cycles : 0.0;
    from.x = c->x + share * (s->x - c->x);
    from.y = c->y + share * (s->y - c->y);
    from.heading = c->heading + share * number_wrap(s->heading - c->heading);
    number_sincos(from.heading, &from.sine, &from.cosine);
  }
  const part_turret *turret = self->turret;
  if (turret != NULL) turn_view(&from, turret, turret->before + share * (turret->angle - turret->before));
  return from;
}
