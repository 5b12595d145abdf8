/* brown_out.c: see brown_out.h. */
#include "brown_out.h"

static void hold(brown_out *self, board *target, int held) {
  if (held && !self->held) self->resets++;
  if (held != self->held) target->op->hold(target, held != 0);
  self->held = held;
}

void brown_out_step(brown_out *self, board *target, double volts, double dt) {
  const brown_out_parameters *p = &self->parameters;
  const double border = p->reset_v + (self->held ? p->hysteresis_v : 0.0);
  hold(self, target, volts < border);
  if (self->held || !self->noise.on || volts >= p->erratic_v || !(p->upsets_per_s > 0.0)) return;
  const double depth = (p->erratic_v - volts) / (p->erratic_v - p->reset_v); /* 0 to 1 */
  if (noise_next_uniform(&self->noise) >= p->upsets_per_s * depth * dt) return;
  self->upsets++;
  target->op->reset(target, BOARD_RESET_WATCHDOG);
}
