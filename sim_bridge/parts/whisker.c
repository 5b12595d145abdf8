/* whisker.c: see whisker.h. */
#include "whisker.h"

#include "geometry/numbers.h"

#define BOUNCES_MAXIMUM 4

/* Drives the change and its bounce: an exponential length, cut at five times the mean, a few flicks within it. */
static void change(whisker *self, uint64_t cycle, uint8_t level) {
  noise_source *noise = &self->part.noise;
  const uint8_t pin = self->part.pins[0].pin;
  part_drive(&self->part, cycle, pin, level);
  if (self->parameters.bounce_s <= 0.0 || !noise->on) return;
  double length = -self->parameters.bounce_s * number_log(1.0 - noise_next_uniform(noise));
  if (length > 5.0 * self->parameters.bounce_s) length = 5.0 * self->parameters.bounce_s;
  const int flicks = (int)(noise_next_uniform(noise) * (BOUNCES_MAXIMUM + 1));
  const double share = length * BOARD_CLOCK_HZ / (2.0 * BOUNCES_MAXIMUM);
  double at = (double)cycle;
  for (int i = 0; i < 2 * flicks; i++) {
    at += 16.0 + share * 2.0 * noise_next_uniform(noise);
    part_drive(&self->part, (uint64_t)at, pin, (i & 1) ? level : (uint8_t)!level);
  }
}

static void step(part *base) {
  whisker *self = (whisker *)base;
  const whisker_parameters *p = &self->parameters;
  const chassis *c = base->chassis;
  const uint8_t pressed =
      (uint8_t)body_segment_touches(c->body, c->around, p->root_x, p->root_y, p->tip_x, p->tip_y, p->height);
  if (pressed == self->pressed) return;
  self->pressed = pressed;
  change(self, part_step_end(base) + PART_GUARD, pressed ? BOARD_LOW : BOARD_HIGH);
}

static const part_operations OPERATIONS = {.step = step};

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
