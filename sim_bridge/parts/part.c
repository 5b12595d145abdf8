/* part.c: see part.h. */
#include "part.h"

#include <math.h>

#include "../world/numbers.h"

void part_join(part *self, const part_operations *op, const part_place *place, const part_pin *pins, int count) {
  self->op = op;
  self->chassis = place->chassis;
  self->noise = place->noise;
  self->off = 0;
  for (int i = 0; i < PART_PINS; i++) self->pins[i] = i < count ? pins[i] : (part_pin){PART_NO_PIN, 0};
}

void part_drive(part *self, uint64_t at, uint8_t pin, uint8_t level) {
  if (pin >= BOARD_PIN_COUNT || self->off) return;
  self->chassis->driven[pin] = level;
  self->chassis->board->op->drive(self->chassis->board, at, pin, level);
}

part_pose part_pose_at(const part *self, const part_mount *mount, uint64_t cycle) {
  const chassis *c = self->chassis;
  const body_state *s = &c->body->state;
  double x = s->x, y = s->y, heading = s->heading, cosine = s->cosine, sine = s->sine;
  if (cycle < c->since + c->step_cycles) {
    const double share = cycle > c->since ? (double)(cycle - c->since) / (double)c->step_cycles : 0.0;
    x = c->x + share * (s->x - c->x);
    y = c->y + share * (s->y - c->y);
    heading = c->heading + share * number_wrap(s->heading - c->heading);
    number_sincos(heading, &sine, &cosine);
  }
  return (part_pose){.x = x + mount->x * cosine - mount->y * sine, /* (3.9) */
                     .y = y + mount->x * sine + mount->y * cosine,
                     .heading = heading + mount->heading};
}

double part_look(const part *self, const part_pose *from, double beam, int rays, double height, double reach,
                 double grazing_cosine) {
  const chassis *c = self->chassis;
  double nearest = -1.0;
  for (int i = 0; i < rays; i++) {
    const double share = rays > 1 ? (double)i / (double)(rays - 1) - 0.5 : 0.0; /* (3.10), (3.11) */
    double sine, cosine;
    number_sincos(from->heading + share * beam, &sine, &cosine);
    ray_hit hit;
    const double d = scene_ray(c->around, from->x, from->y, cosine, sine, reach, height, c->self_id, &hit);
    if (d < 0.0 || (nearest >= 0.0 && d >= nearest)) continue;
    if (fabs(cosine * hit.normal_x + sine * hit.normal_y) < grazing_cosine) continue;
    nearest = d;
  }
  return nearest;
}

void part_log_look(const part *self, uint64_t cycle, int kind, const part_pose *from, double beam, double reach,
                   double distance) {
  if (!self->chassis->recording) return;
  const sim_look look = {
      .time = (double)cycle / BOARD_CLOCK_HZ,
      .kind = kind,
      .x = from->x,
      .y = from->y,
      .heading = from->heading,
      .beam = beam,
      .reach = reach,
      .distance = distance,
  };
  buffer_append(self->chassis->looks, &look, sizeof look);
}
