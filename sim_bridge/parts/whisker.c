/* whisker.c: see whisker.h. */
#include "whisker.h"

static void step(part *base) {
  whisker *self = (whisker *)base;
  const whisker_parameters *p = &self->parameters;
  const chassis *c = base->chassis;
  const uint8_t pressed =
      (uint8_t)body_segment_touches(c->body, c->around, p->root_x, p->root_y, p->tip_x, p->tip_y, p->height);
  if (pressed == self->pressed) return;
  self->pressed = pressed;
  const uint8_t level = pressed ? BOARD_LOW : BOARD_HIGH;
  const uint64_t at = part_step_end(base) + PART_GUARD;
  part_bounce(base, &base->noise, at, level, (uint8_t)!level, p->bounce_s);
  fault *bouncing = part_fault(base, FAULT_BOUNCING, at);
  if (bouncing == NULL) return;
  noise_source draws = fault_noise(bouncing, at);
  bouncing->fired += part_bounce(base, &draws, at, level, (uint8_t)!level, bouncing->value) > 0;
}

static void hold(const part *base, fault *f) {
  if (f->kind != FAULT_STUCK) return;
  f->pin = base->pins[0].pin;
  f->level = f->value > 0.0 ? BOARD_LOW : BOARD_HIGH;
}

static int read(part *base, double *values) {
  *values = ((whisker *)base)->pressed;
  return 1;
}

static const part_operations OPERATIONS = {.step = step, .read = read, .hold = hold};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  whisker *self = (whisker *)base;
  part_join(base, &OPERATIONS, place, &(part_pin){pins[0], PART_DRIVES | PART_PULLED_UP}, 1);
  self->parameters = *(const whisker_parameters *)parameters;
  body_widen_reach(place->chassis->body, self->parameters.root_x, self->parameters.root_y);
  body_widen_reach(place->chassis->body, self->parameters.tip_x, self->parameters.tip_y);
  part_drive(base, 0, pins[0], BOARD_HIGH);
  return 0;
}

const part_kind whisker_kind = {.size = sizeof(whisker), .noise = 21, .pins = 1, .init = init};
