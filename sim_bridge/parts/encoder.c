/* encoder.c: see encoder.h. */
#include "encoder.h"

#include <string.h>

#include "../world/numbers.h"

static uint8_t level_a(const encoder *self, long long index) {
  if (self->pin_b == PART_NO_PIN) return (uint8_t)(index & 1);
  return (uint8_t)(((index & 3) == 1 || (index & 3) == 2) ? 1 : 0);
}

static uint8_t level_b(long long index) { return (uint8_t)((index >> 1) & 1); }

static double wheel_angle(const encoder *self) {
  const body_state *s = &self->part.chassis->body->state;
  return self->side == 0 ? s->wheel_left : s->wheel_right;
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
    if (level_a(self, next) != level_a(self, self->index)) part_drive(base, at, self->pin_a, level_a(self, next));
    if (level_b(next) != level_b(self->index)) part_drive(base, at, self->pin_b, level_b(next));
    self->index = next;
  }
}

static const part_operations OPERATIONS = {.step = step};

void encoder_init(encoder *self, const part_place *place, int side, uint8_t pin_a, uint8_t pin_b,
                  uint32_t edges_per_turn) {
  memset(self, 0, sizeof *self);
  const part_pin pins[] = {{pin_a, PART_DRIVES}, {pin_b, PART_DRIVES}};
  part_join(&self->part, &OPERATIONS, place, pins, 2);
  self->side = side;
  self->pin_a = pin_a;
  self->pin_b = pin_b;
  self->edges_per_rad = (double)edges_per_turn / (2.0 * NUMBERS_PI);
  self->phase = noise_next_uniform(&self->part.noise); /* 0.5 without noise */
  self->position = wheel_angle(self) * self->edges_per_rad + self->phase;
  self->index = number_floor(self->position);
  part_drive(&self->part, 0, pin_a, level_a(self, self->index));
  part_drive(&self->part, 0, pin_b, level_b(self->index));
}
