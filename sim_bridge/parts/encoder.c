/* encoder.c: see encoder.h. */
#include "encoder.h"

#include "geometry/numbers.h"

static uint8_t level_a(const encoder *self, long long index) {
  if (self->part.pins[1].pin == PART_NO_PIN) /* one channel */
    return (uint8_t)(index & 1);
  return (uint8_t)(((index & 3) == 1 || (index & 3) == 2) ? 1 : 0);
}

static uint8_t level_b(long long index) { return (uint8_t)((index >> 1) & 1); }

static double wheel_angle(const encoder *self) {
  const body_state *s = &self->part.chassis->body->state;
  return self->side == 0 ? s->wheel_left : s->wheel_right;
}

/* Goes back and forth after an edge at cycle `at`. Returns when it has settled. */
static uint64_t bounce(encoder *self, uint64_t at, uint8_t pin, uint8_t level) {
  const encoder_parameters *p = &self->parameters;
  const uint64_t pairs = (uint64_t)(noise_next_uniform(&self->part.noise) * (p->bounces + 1.0));
  for (uint64_t i = 0; i < 2 * pairs; i++) {
    at += 2u + (uint64_t)(2.0 * p->bounce_s * BOARD_CLOCK_HZ * noise_next_uniform(&self->part.noise));
    part_drive(&self->part, at, pin, (i & 1) ? level : (uint8_t)!level);
  }
  return at;
}

/* An edge of one channel (0: A, 1: B) at cycle `at`: as it is, or missed, or with bounces or a flicker after it. */
static void show(encoder *self, uint64_t at, int channel, uint8_t level) {
  const encoder_parameters *p = &self->parameters;
  const uint8_t pin = self->part.pins[channel].pin;
  if (pin == PART_NO_PIN || self->part.level[channel] == level) return; /* the one before it was missed */
  if (p->missed > 0.0 && noise_next_uniform(&self->part.noise) < p->missed) return;
  part_drive(&self->part, at, pin, level);
  if (p->bounces > 0.0 && self->part.noise.on) {
    at = bounce(self, at, pin, level);
  }
  if (!(p->extra > 0.0) || noise_next_uniform(&self->part.noise) >= p->extra) return;
  const double mean = p->flicker_s * BOARD_CLOCK_HZ;
  const uint64_t off = at + 2u + (uint64_t)(mean * noise_next_uniform(&self->part.noise));
  part_drive(&self->part, off, pin, (uint8_t)!level);
  part_drive(&self->part, off + 2u + (uint64_t)(mean * noise_next_uniform(&self->part.noise)), pin, level);
}

static void step(part *base) {
  encoder *self = (encoder *)base;
  const chassis *c = base->chassis;
  const double before = self->position;
  const double after = wheel_angle(self) * self->edges_per_rad + self->phase;
  self->position = after;
  while (after >= (double)(self->index + 1) || after < (double)self->index) {
    const int forward = after >= (double)(self->index + 1);
    const double border = (double)(forward ? self->index + 1 : self->index);
    const long long next = forward ? self->index + 1 : self->index - 1;
    double share = (border - before) / (after - before);
    if (!(share > 0.0)) share = 0.0;
    if (share > 1.0) share = 1.0;
    const uint64_t at = c->since + PART_GUARD + (uint64_t)(share * (double)c->step_cycles);
    if (level_a(self, next) != level_a(self, self->index)) show(self, at, 0, level_a(self, next));
    if (level_b(next) != level_b(self->index)) show(self, at, 1, level_b(next));
    self->index = next;
  }
}

static int read(part *base, double *values) {
  const encoder *self = (encoder *)base;
  *values = (double)(self->index - self->first);
  return 1;
}

static const part_operations OPERATIONS = {.step = step, .read = read};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  encoder *self = (encoder *)base;
  const encoder_parameters *p = parameters;
  part_join(base, &OPERATIONS, place, (part_pin[]){{pins[0], PART_DRIVES}, {pins[1], PART_DRIVES}}, 2);
  self->side = place->index;
  self->parameters = *p;
  self->edges_per_rad = (double)p->edges_per_turn / (2.0 * NUMBERS_PI);
  self->phase = noise_next_uniform(&base->noise); /* 0.5 without noise */
  self->position = wheel_angle(self) * self->edges_per_rad + self->phase;
  self->index = self->first = number_floor(self->position);
  part_drive(base, 0, pins[0], level_a(self, self->index));
  part_drive(base, 0, pins[1], level_b(self->index));
  return 0;
}

const part_kind encoder_kind = {.size = sizeof(encoder), .noise = 11, .pins = 2, .init = init};
