/* truth.c: see loop.h. Here: what the simulation reports of itself. */
#include <string.h>

#include "state.h"

void robot_record(robot *r, uint64_t cycle) {
  if (cycle < r->next_row) return;
  r->next_row = cycle + 1u;
  const body_state *s = &r->body->state;
  const sim_truth row = {
      .time = (double)cycle / BOARD_CLOCK_HZ,
      .x = s->x,
      .y = s->y,
      .heading = s->heading,
      .speed = s->speed,
      .turn_rate = s->turn_rate,
      .left = body_left_speed(r->body),
      .right = body_right_speed(r->body),
      .contact = r->touched,
  };
  r->touched = s->touching;
  buffer_append(&r->truth, &row, sizeof row);
}

void sim_record_waits(sim *self, uint64_t begin) {
  for (size_t k = 0; k < self->world.obstacles; k++) {
    const mover *m = &self->movers[k];
    mover_clock *clock = &self->clocks[k];
    const double lost = m->waited > clock->waited ? self->world.dt - m->stops : 0.0;
    const sim_wait row = {(double)begin / BOARD_CLOCK_HZ, (double)k, clock->waited};
    if (lost != clock->lost) buffer_append(&self->waits, &row, sizeof row);
    *clock = (mover_clock){.waited = m->waited, .lost = lost};
  }
}

uint64_t sim_hash(const sim *self) {
  uint64_t hash = 0xcbf29ce484222325u; /* FNV-1a */
  for (int i = 0; i < self->robot_count; i++) {
    const body_state *s = &self->robots[i]->body->state;
    const double state[] = {
        s->x,         s->y,          s->heading,     s->speed,    s->turn_rate,        s->lateral,         s->rim_left,
        s->rim_right, s->wheel_left, s->wheel_right, s->distance, (double)s->touching, (double)s->slipping};
    uint8_t bytes[sizeof state];
    memcpy(bytes, state, sizeof state);
    for (size_t k = 0; k < sizeof bytes; k++) hash = (hash ^ bytes[k]) * 0x100000001b3u;
  }
  return hash;
}
