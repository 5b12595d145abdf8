/* encoder.c: see encoder.h. */
#include "encoder.h"

#include <string.h>

#include "../world/numbers.h"

static uint8_t level_a(const encoder *self, long long index) {
  if (self->pin_b == PART_NO_PIN) return (uint8_t)(index & 1);
  return (uint8_t)(((index & 3) == 1 || (index & 3) == 2) ? 1 : 0);
}

static uint8_t level_b(long long index) { return (uint8_t)((index >> 1) & 1); }

void encoder_init(encoder *self, const part_place *place, uint8_t pin_a, uint8_t pin_b, uint32_t edges_per_turn,
                  double angle) {
  memset(self, 0, sizeof *self);
  self->place = *place;
  self->pin_a = pin_a;
  self->pin_b = pin_b;
  self->edges_per_rad = (double)edges_per_turn / (2.0 * NUMBERS_PI);
  self->phase = noise_next_uniform(&self->place.noise); /* 0.5 without noise */
  self->position = angle * self->edges_per_rad + self->phase;
  self->index = number_floor(self->position);
  part_drive(&self->place, 0, pin_a, level_a(self, self->index));
  part_drive(&self->place, 0, pin_b, level_b(self->index));
}

void encoder_step(encoder *self, double angle, uint64_t cycle, uint32_t step_cycles) {
  const double before = self->position;
  const double after = angle * self->edges_per_rad + self->phase;
  self->position = after;
  while (after >= (double)(self->index + 1) || after < (double)self->index) {
    const int forward = after >= (double)(self->index + 1);
    const double border = (double)(forward ? self->index + 1 : self->index);
    const long long next = forward ? self->index + 1 : self->index - 1;
    double share = (border - before) / (after - before);
    if (!(share > 0.0)) share = 0.0;
    if (share > 1.0) share = 1.0;
    const uint64_t at = cycle + PART_GUARD + (uint64_t)(share * (double)step_cycles);
    if (level_a(self, next) != level_a(self, self->index))
      part_drive(&self->place, at, self->pin_a, level_a(self, next));
    if (level_b(next) != level_b(self->index)) part_drive(&self->place, at, self->pin_b, level_b(next));
    self->index = next;
  }
}
