/* interventions.c: see loop.h. Here: what a test does to a simulation, past its parts. */
#include <stdlib.h>

#include "state.h"

/* The truth has where it was, and a cycle later where it is. */
static void lift(robot *r, double x, double y, double heading) {
  const uint64_t at = r->sim->world_at;
  const int is_recorded = r->sim->record_cycles > 0;
  if (is_recorded && at > 0) robot_record(r, at - 1u);
  body_place(r->body, x, y, heading);
  r->touched = 0;
  if (is_recorded) robot_record(r, at > r->next_row ? at : r->next_row);
}

int robot_place(robot *self, double x, double y, double heading) {
  world *w = &self->sim->world;
  if (!world_is_free(w, x, y, self->body->body_reach, self->chassis.self_id)) return SIM_NOT_FREE;
  lift(self, x, y, heading);
  self->chassis.x = x;
  self->chassis.y = y;
  self->chassis.heading = heading;
  world_update(w);
  return SIM_OK;
}

int sim_place_shape(sim *self, int shape, double x, double y, double heading) {
  if (!world_place_obstacle(&self->world, (size_t)shape, x, y, heading)) return SIM_NOT_FREE;
  const mover *m = &self->movers[shape];
  const sim_shift row = {(double)self->world_at / BOARD_CLOCK_HZ, shape, m->shift_x, m->shift_y, m->shift_heading};
  if (self->record_cycles > 0) buffer_append(&self->shifts, &row, sizeof row);
  return SIM_OK;
}

/* Takes a pin from its part, or gives it back; no voltage is held there any more. Returns what the part does there (PART_DRIVES, ...); 0: none drives it. */
static int override(robot *r, uint8_t pin, int overridden) {
  int role = 0;
  if (pin >= BOARD_FIRST_ANALOG_PIN) r->held[pin - BOARD_FIRST_ANALOG_PIN] = NAN;
  for (int i = 0; i < r->part_count; i++) {
    part *p = r->parts[i];
    for (int k = 0; k < PART_PINS; k++) {
      if (p->pins[k].pin != pin || !(p->pins[k].role & PART_DRIVES)) continue;
      p->overridden = overridden;
      role |= p->pins[k].role;
      if (!overridden) part_show(p, k);
    }
  }
  return role;
}

void robot_drive(robot *self, uint64_t at, uint8_t pin, uint8_t level) {
  const int role = override(self, pin, 1);
  if (level == BOARD_RELEASED && (role & PART_PULLED_UP)) level = BOARD_HIGH;
  self->chassis.driven[pin] = level;
  self->board->op->drive(self->board, at, pin, level);
}

void robot_drive_edges(robot *self, uint8_t pin, const uint64_t *at, const uint8_t *levels, size_t count) {
  for (size_t i = 0; i < count; i++) robot_drive(self, at[i], pin, levels[i]);
}

void robot_release(robot *self, uint8_t pin) {
  if (override(self, pin, 0)) return;
  self->chassis.driven[pin] = BOARD_RELEASED;
  self->board->op->drive(self->board, 0, pin, BOARD_RELEASED);
}

void robot_unplug(robot *self, int number, int unplugged) {
  part *p = self->parts[number];
  const board_operations *op = self->board->op;
  for (int i = 0; p->unplugged && !unplugged && i < PART_PINS; i++) { /* it hears what its pins have become */
    const uint8_t pin = p->pins[i].pin;
    if (!(p->pins[i].role & PART_HEARS) || pin >= BOARD_PIN_COUNT) continue;
    p->op->edge(p, op->now(self->board), pin, robot_heard(self, p, pin, op->output(self->board, pin)));
  }
  part_unplug(p, unplugged);
}

int robot_fault(robot *self, int number, int kind, double value, uint64_t begin, uint64_t end) {
  part *of = number < 0 ? NULL : self->parts[number];
  fault **faults = realloc(self->faults, (size_t)(self->fault_count + 1) * sizeof *faults);
  if (faults == NULL) return SIM_NO_MEMORY;
  self->faults = faults;
  fault *made = calloc(1, sizeof *made);
  if (made == NULL) return SIM_NO_MEMORY;
  const uint32_t device = FAULT_NOISE * ((uint32_t)kind + 1u) + (of == NULL ? 0u : of->noise.device);
  *made = (fault){.kind = kind, .value = value, .begin = begin, .end = end, .pin = PART_NO_PIN};
  made->key = noise_key(self->sim->seed, (uint32_t)self->number, device);
  if ((of == NULL ? fault_insert(&self->chassis.faults[-1 - number], made) : part_add_fault(of, made)) != 0) {
    free(made);
    return SIM_BAD_ARGUMENT;
  }
  faults[self->fault_count] = made;
  return self->fault_count++;
}

uint64_t robot_fault_fired(const robot *self, int number) {
  const fault *f = self->faults[number];
  const int took_pin = f->pin != PART_NO_PIN && f->before != f->level && self->sim->now >= f->begin;
  return f->fired + (uint64_t)took_pin;
}
