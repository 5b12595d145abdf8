/* snapshot.c: the state of one world as a hash and as bytes. A snapshot opens with its version, the print of its model and
 * a checksum of the rest. */
#include <string.h>

#include "vehicle.h"

#define MAGIC UINT64_C(0x31766f6265623276) /* with the layout's version in it */

typedef struct {
  uint64_t magic, print, size, checksum;
} heading_of_snapshot;

typedef struct {
  body_state body;
  vehicle_state state;
} fixed_part;

static uint64_t mixed(uint64_t sum, const void *bytes, size_t size) {
  const unsigned char *at = bytes;
  for (size_t i = 0; i < size; i += sizeof(uint64_t)) {
    uint64_t word = 0;
    memcpy(&word, at + i, size - i < sizeof word ? size - i : sizeof word);
    sum = noise_mix(sum ^ word);
  }
  return sum;
}

/* What a moving shape has come to. */
typedef struct {
  double waited;
  uint64_t waits;
} moving_part;

static size_t moving_count(const vehicle *w) { return vehicle_scene(w).movers_count; }

static moving_part part_of(const mover *m) { return (moving_part){m->waited, (uint64_t)(m->waits != 0)}; }

uint64_t vehicles_hash(const vehicles *self, size_t i) {
  const vehicle_model *m = self->model;
  const vehicle *w = &self->worlds[i];
  const body_state *b = &w->body.state;
  const vehicle_state *s = &w->state;
  const double values[] = {b->x,          b->y,           b->heading,     b->speed,        b->turn_rate, b->lateral,
                           b->rim_left,   b->rim_right,   b->wheel_left,  b->wheel_right,  b->distance,  s->signals[0],
                           s->signals[1], s->currents[0], s->currents[1], s->acceleration, s->energy};
  const uint64_t counts[] = {s->step, s->id, (uint64_t)(uint32_t)s->flag, (uint64_t)(b->touching != 0)};
  uint64_t sum = mixed(mixed(0, values, sizeof values), counts, sizeof counts);
  for (size_t k = 0; k < moving_count(w); k++) {
    const moving_part moving = part_of(&w->movers[k]);
    sum = mixed(sum, &moving, sizeof moving);
  }
  return mixed(sum, &self->readings[i * m->readings], m->readings * sizeof(double));
}

static size_t slots_size(const vehicles *self) { return self->model->sensors_count * sizeof(sensor_slot); }

static size_t readings_size(const vehicles *self) { return self->model->readings * sizeof(double); }

size_t vehicles_snapshot_size(const vehicles *self, size_t i) {
  return sizeof(heading_of_snapshot) + sizeof(fixed_part) + slots_size(self) + readings_size(self) + self->state_size +
         moving_count(&self->worlds[i]) * sizeof(moving_part);
}

void vehicles_save(const vehicles *self, size_t i, void *bytes) {
  unsigned char *at = (unsigned char *)bytes + sizeof(heading_of_snapshot);
  fixed_part fixed;
  memset(&fixed, 0, sizeof fixed);
  fixed.body = self->worlds[i].body.state;
  fixed.state = self->worlds[i].state;
  memcpy(at, &fixed, sizeof fixed);
  at += sizeof fixed;
  memcpy(at, &self->slots[i * self->model->sensors_count], slots_size(self));
  at += slots_size(self);
  memcpy(at, &self->readings[i * self->model->readings], readings_size(self));
  at += readings_size(self);
  memcpy(at, self->brains + i * self->state_size, self->state_size);
  at += self->state_size;
  for (size_t k = 0; k < moving_count(&self->worlds[i]); k++) {
    const moving_part moving = part_of(&self->worlds[i].movers[k]);
    memcpy(at + k * sizeof moving, &moving, sizeof moving);
  }
  const size_t size = vehicles_snapshot_size(self, i);
  const unsigned char *rest = (const unsigned char *)bytes + sizeof(heading_of_snapshot);
  const heading_of_snapshot heading = {MAGIC, vehicle_model_print(self->model), size,
                                       mixed(MAGIC, rest, size - sizeof(heading_of_snapshot))};
  memcpy(bytes, &heading, sizeof heading);
}

int vehicles_restore(vehicles *self, size_t i, const void *bytes, size_t size) {
  heading_of_snapshot heading;
  vehicle *w = &self->worlds[i];
  if (w->where == NULL) return VEHICLE_NOT_PLACED;
  if (size != vehicles_snapshot_size(self, i)) return VEHICLE_BAD_SNAPSHOT;
  memcpy(&heading, bytes, sizeof heading);
  const unsigned char *at = (const unsigned char *)bytes + sizeof heading;
  if (heading.magic != MAGIC || heading.size != size || heading.print != vehicle_model_print(self->model) ||
      heading.checksum != mixed(MAGIC, at, size - sizeof heading))
    return VEHICLE_BAD_SNAPSHOT;
  fixed_part fixed;
  memcpy(&fixed, at, sizeof fixed);
  at += sizeof fixed;
  memcpy(&self->slots[i * self->model->sensors_count], at, slots_size(self));
  at += slots_size(self);
  memcpy(&self->readings[i * self->model->readings], at, readings_size(self));
  at += readings_size(self);
  memcpy(self->brains + i * self->state_size, at, self->state_size);
  at += self->state_size;
  for (size_t k = 0; k < moving_count(w); k++) {
    moving_part moving;
    memcpy(&moving, at + k * sizeof moving, sizeof moving);
    w->movers[k].waited = moving.waited;
    w->movers[k].waits = moving.waits != 0;
  }
  body_place(&w->body, fixed.body.x, fixed.body.y, fixed.body.heading); /* forgets what was near */
  w->body.state = fixed.body;
  w->state = fixed.state;
  vehicles_update_arena(self, i);
  return VEHICLE_OK;
}
