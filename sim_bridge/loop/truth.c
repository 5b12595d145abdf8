/* truth.c: see loop.h. Here: what the simulation reports of itself. */
#include <string.h>

#include "state.h"

void sim_body(const sim *self, int number, body_state *out) {
  const robot *r = sim_robot(self, number);
  if (r != NULL) *out = r->body->state;
}

const sim_truth *sim_record(const sim *self, int number, size_t *count) {
  const robot *r = sim_robot(self, number);
  *count = r == NULL ? 0 : r->truth.count / sizeof(sim_truth);
  return r == NULL ? NULL : (const sim_truth *)(const void *)r->truth.data;
}

const sim_look *sim_looks(const sim *self, int number, size_t *count) {
  const robot *r = sim_robot(self, number);
  *count = r == NULL ? 0 : r->looks.count / sizeof(sim_look);
  return r == NULL ? NULL : (const sim_look *)(const void *)r->looks.data;
}

const sim_tone *sim_tones(const sim *self, int number, size_t *count) {
  const robot *r = sim_robot(self, number);
  *count = r == NULL ? 0 : r->tones.count / sizeof(sim_tone);
  return r == NULL ? NULL : (const sim_tone *)(const void *)r->tones.data;
}

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

const sim_wait *sim_waits(const sim *self, size_t *count) {
  *count = self->waits.count / sizeof(sim_wait);
  return (const sim_wait *)(const void *)self->waits.data;
}

const sim_shift *sim_shifts(const sim *self, size_t *count) {
  *count = self->shifts.count / sizeof(sim_shift);
  return (const sim_shift *)(const void *)self->shifts.data;
}

void sim_forget(sim *self, int number) {
  robot *r = sim_robot(self, number);
  if (r != NULL) r->truth.count = r->looks.count = r->tones.count = 0;
}

void sim_forget_world(sim *self) { self->waits.count = self->shifts.count = 0; }

const mover *sim_movers(const sim *self, size_t *count, double *time) {
  *count = self->world.obstacles;
  *time = (double)self->world_at / BOARD_CLOCK_HZ;
  return self->movers;
}

double sim_turret_angle(const sim *self, int number, uint8_t pin) {
  const robot *r = sim_robot(self, number);
  const turret *t = r == NULL ? NULL : robot_turret(r, pin);
  return t == NULL ? 0.0 : t->motor.angle;
}

uint64_t sim_contacts(const sim *self, int number) {
  const robot *r = sim_robot(self, number);
  return r == NULL ? 0 : r->contacts;
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

size_t sim_edges(const sim *self, int number, sim_edge *out, size_t capacity) {
  const robot *r = sim_robot(self, number);
  return r == NULL ? 0 : edge_log_copy(&r->edges, out, capacity);
}

uint64_t sim_edges_seen(const sim *self, int number) {
  const robot *r = sim_robot(self, number);
  return r == NULL ? 0 : r->edges.count;
}

double sim_pack_voltage(const sim *self, int number) {
  const robot *r = sim_robot(self, number);
  return r == NULL || r->battery == NULL ? 0.0 : r->battery->supply.pack_v;
}

double sim_supply_voltage(const sim *self, int number) {
  const robot *r = sim_robot(self, number);
  return r == NULL ? 0.0 : r->chassis.supply * BOARD_NOMINAL_VOLTS;
}

uint64_t sim_reset_at(const sim *self, int number) {
  const robot *r = sim_robot(self, number);
  return r == NULL ? 0 : r->reset_at;
}

uint32_t sim_brown_outs(const sim *self, int number, uint32_t *upsets) {
  const robot *r = sim_robot(self, number);
  *upsets = r == NULL ? 0 : r->brown_out.upsets;
  return r == NULL ? 0 : r->brown_out.resets;
}
