/* state_hash.c: the state of one world as a hash; see vehicles_hash in vehicle.h.
 *
 * It goes through all numbers that a world has come to, in one order. What follows from model, arena and the rest is not
 * among them. */
#include "geometry/hash.h"
#include "vehicle.h"

static void whole(uint64_t *sum, uint64_t value) { *sum = hash_word(*sum, value); }

static void numbers(uint64_t *sum, const double *values, size_t count) {
  for (size_t i = 0; i < count; i++) whole(sum, hash_bits(values[i]));
}

#define NUMBERS(sum, ...) \
  numbers((sum), (const double[]){__VA_ARGS__}, sizeof((double[]){__VA_ARGS__}) / sizeof(double))

static void hash_body(uint64_t *sum, const body_state *b) {
  NUMBERS(sum, b->x, b->y, b->speed, b->turn_rate, b->lateral, b->rim_left, b->rim_right, b->wheel_left, b->wheel_right,
          b->distance, b->touch_x, b->touch_y, b->heading, b->cosine, b->sine);
  whole(sum, (uint64_t)b->touching);
  whole(sum, (uint64_t)b->slipping);
}

static void hash_state(uint64_t *sum, const vehicle_state *v) {
  const uint64_t wholes[] = {v->seed, v->id, v->step, v->sensed, v->next_pulse, (uint64_t)v->flag};
  for (size_t i = 0; i < sizeof wholes / sizeof *wholes; i++) whole(sum, wholes[i]);
  NUMBERS(sum, v->signals[0], v->signals[1], v->energy, v->currents[0], v->currents[1], v->acceleration);
  for (int side = 0; side < 2; side++) {
    const servo_motor *m = &v->servos[side];
    NUMBERS(sum, m->pulse_us, m->age_s, m->target, m->reference);
  }
}

uint64_t vehicles_hash(const vehicles *self, size_t i) {
  const vehicle_model *m = self->model;
  const vehicle *w = &self->worlds[i];
  uint64_t sum = 0;
  hash_body(&sum, &w->body.state);
  hash_state(&sum, &w->state);
  if (m->has_board) whole(&sum, (uint64_t)w->state.coasts);
  for (size_t k = 0; k < w->own.obstacles; k++) { /* where a moving shape is follows from time and waiting */
    NUMBERS(&sum, w->own.movers[k].waited);
    whole(&sum, (uint64_t)w->own.movers[k].waits);
  }
  for (size_t k = 0; k < m->sensors_count; k++) {
    const sensor_slot *slot = &self->slots[i * m->sensors_count + k];
    if (m->sensors[k].period > 0.0) NUMBERS(&sum, slot->hold.next, slot->hold.taken, slot->hold.value);
    numbers(&sum, slot->memory.numbers, m->sensors[k].kind->numbers);
  }
  numbers(&sum, &self->readings[i * m->readings], m->readings);
  const unsigned char *memory = self->brains + i * self->state_size;
  for (size_t at = 0; at < self->state_size; at += 8) {
    uint64_t word = 0;
    for (size_t k = 0; k < 8; k++) word |= (uint64_t)memory[at + k] << (8 * k);
    whole(&sum, word);
  }
  return sum;
}
