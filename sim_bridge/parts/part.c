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
  for (int i = 0; i < PART_PINS; i++) {
    self->pins[i] = i < count ? pins[i] : (part_pin){PART_NO_PIN, 0};
    self->level[i] = BOARD_RELEASED;
  }
}

static void drive(part *self, uint64_t at, uint8_t pin, uint8_t level) {
  self->chassis->driven[pin] = level;
  self->chassis->board->op->drive(self->chassis->board, at, pin, level);
}

void part_drive(part *self, uint64_t at, uint8_t pin, uint8_t level) {
  if (pin >= BOARD_PIN_COUNT) return;
  for (int i = 0; i < PART_PINS; i++) {
    if (self->pins[i].pin == pin) self->level[i] = level;
  }
  if (!self->overridden && !self->unplugged) drive(self, at, pin, level);
}

void part_bounce(part *self, uint64_t at, uint8_t level, uint8_t before, double mean_s) {
  noise_source *noise = &self->noise;
  const uint8_t pin = self->pins[0].pin;
  part_drive(self, at, pin, level);
  if (mean_s <= 0.0 || !noise->on) return;
  double length = -mean_s * number_log(1.0 - noise_next_uniform(noise));
  if (length > 5.0 * mean_s) length = 5.0 * mean_s;
  const int flicks = (int)(noise_next_uniform(noise) * (BOUNCES_MAXIMUM + 1));
  const double share = length * BOARD_CLOCK_HZ / (2.0 * BOUNCES_MAXIMUM);
  double next = (double)at;
  for (int i = 0; i < 2 * flicks; i++) {
    next += 16.0 + share * 2.0 * noise_next_uniform(noise);
    part_drive(self, (uint64_t)next, pin, (i & 1) ? level : before);
  }
}

void part_unplug(part *self, int unplugged) {
  const uint64_t now = self->chassis->board->op->now(self->chassis->board);
  self->unplugged = unplugged;
  if (self->overridden) return;
  for (int i = 0; i < PART_PINS; i++) {
    if (!(self->pins[i].role & PART_DRIVES) || self->pins[i].pin >= BOARD_PIN_COUNT) continue;
    drive(self, now, self->pins[i].pin, unplugged ? (uint8_t)BOARD_RELEASED : self->level[i]);
  }
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

void part_log_look(const part *self, uint64_t cycle, int kind, const viewpoint *from, const beam_parameters *mount,
                   double reach, double distance) {
  if (!self->chassis->recording) return;
  const sim_look look = {
      .time = (double)cycle / BOARD_CLOCK_HZ,
      .kind = kind,
      .x = from->x + mount->x * from->cosine - mount->y * from->sine,
      .y = from->y + mount->x * from->sine + mount->y * from->cosine,
      .heading = from->heading + mount->heading,
      .beam = mount->opening,
      .reach = reach,
      .distance = distance,
  };
  buffer_append(self->chassis->looks, &look, sizeof look);
}
