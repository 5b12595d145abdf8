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

/* There and back after an edge at cycle `at`. */
static void flicker(encoder *self, noise_source *noise, uint64_t at, uint8_t pin, uint8_t level) {
  const double mean = self->parameters.flicker_s * BOARD_CLOCK_HZ;
  const uint64_t off = at + 2u + (uint64_t)(mean * noise_next_uniform(noise));
  part_drive(&self->part, off, pin, (uint8_t)!level);
  part_drive(&self->part, off + 2u + (uint64_t)(mean * noise_next_uniform(noise)), pin, level);
}

/* The fault of that kind, if it is drawn for the edge at cycle `at`, and what else it draws from. */
static fault *drawn(encoder *self, int kind, uint64_t at, noise_source *draws) {
  fault *f = part_fault(&self->part, kind, at);
  if (f == NULL) return NULL;
  *draws = fault_noise(f, at);
  if (noise_next_uniform(draws) >= f->value) return NULL;
  f->fired++;
  return f;
}

/* An edge of one channel (0: A, 1: B) at cycle `at`: as it is, or missed, or with bounces or a flicker after it. */
static void show(encoder *self, uint64_t at, int channel, uint8_t level) {
  const encoder_parameters *p = &self->parameters;
  const uint8_t pin = self->part.pins[channel].pin;
  if (pin == PART_NO_PIN || self->part.level[channel] == level) return; /* the one before it was missed */
  if (p->missed > 0.0 && noise_next_uniform(&self->part.noise) < p->missed) return;
  noise_source draws;
  if (drawn(self, FAULT_MISSING, at, &draws) != NULL) return;
  part_drive(&self->part, at, pin, level);
  if (p->bounces > 0.0 && self->part.noise.on) {
    at = bounce(self, at, pin, level);
  }
  if (p->extra > 0.0 && noise_next_uniform(&self->part.noise) < p->extra) {
    flicker(self, &self->part.noise, at, pin, level);
  }
  if (drawn(self, FAULT_EXTRA, at, &draws) != NULL) flicker(self, &draws, at, pin, level);
}

/* A fault's square wave at channel A, from where it is to cycle `until`; it is high when the fault begins. */
static void wave(encoder *self, uint64_t until) {
  part *base = &self->part;
  const uint8_t pin = base->pins[0].pin;
  for (fault *f = base->faults; f != NULL; f = f->next) {
    if (f->kind != FAULT_NOISY || until <= f->begin || f->end <= self->waved) continue;
    const uint64_t half = (uint64_t)(BOARD_CLOCK_HZ / (2.0 * f->value));
    const uint64_t past = self->waved > f->begin ? self->waved - f->begin : 0u;
    for (uint64_t n = (past + half - 1u) / half; f->begin + n * half < (until < f->end ? until : f->end); n++) {
      part_put(base, f->begin + n * half, pin, (n & 1u) ? BOARD_LOW : BOARD_HIGH);
      f->fired++;
    }
    part_put(base, f->end, pin, base->level[0]);
  }
  self->waved = until;
}

static void step(part *base) {
  encoder *self = (encoder *)base;
  const chassis *c = base->chassis;
  const double before = self->position;
  const double after = wheel_angle(self) * self->edges_per_rad + self->phase;
  self->position = after;
  self->waved = c->since + PART_GUARD;
  double share;
  for (int way; (way = wheel_encoder_pass(before, after, &self->index, &share)) != 0;) {
    const long long next = self->index, last = next - way;
    const uint64_t at = c->since + PART_GUARD + (uint64_t)(share * (double)c->step_cycles);
    if (base->faults != NULL) wave(self, at);
    if (level_a(self, next) != level_a(self, last)) show(self, at, 0, level_a(self, next));
    if (level_b(next) != level_b(last)) show(self, at, 1, level_b(next));
  }
  if (base->faults != NULL) wave(self, part_step_end(base) + PART_GUARD);
}

static int read(part *base, double *values) {
  const encoder *self = (encoder *)base;
  *values = (double)(self->index - self->first);
  return 1;
}

static void hold(const part *base, fault *f) {
  if (f->kind != FAULT_NOISY) return;
  f->pin = base->pins[0].pin;
  f->level = BOARD_HIGH;
}

static const part_operations OPERATIONS = {.step = step, .read = read, .hold = hold};

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
