/* worlds.c: worlds are made, a vehicle is placed in each, and what can be asked of them; see vehicle.h. */
#include <stdlib.h>
#include <string.h>

#include "sense.h"
#include "vehicle.h"

vehicles *vehicles_new(const vehicle_model *model, size_t count, size_t state_size) {
  if (state_size > SIZE_MAX - 15u) return NULL;
  const size_t block = (state_size + 15u) & ~(size_t)15u; /* every brain's memory is aligned for any type */
  vehicles *self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
  self->model = model;
  self->count = count;
  self->state_size = block;
  self->worlds = calloc(count + 1, sizeof *self->worlds);
  self->slots_count = count * model->sensors_count;
  self->slots = calloc(self->slots_count + 1, sizeof *self->slots);
  self->numbers = calloc(count * model->numbers + 1, sizeof *self->numbers);
  self->readings = calloc(count * model->readings + 1, sizeof *self->readings);
  self->brains = calloc(count + 1, block + 1);
  if (self->worlds == NULL || self->slots == NULL || self->numbers == NULL || self->readings == NULL ||
      self->brains == NULL) {
    vehicles_destroy(self);
    return NULL;
  }
  vehicle_sensors_give_numbers(self);
  return self;
}

/* Frees what belongs to one world. */
static void leave(vehicle *w) {
  free(w->own.movers);
  memset(w, 0, sizeof *w);
}

void vehicles_destroy(vehicles *self) {
  for (size_t i = 0; self->worlds != NULL && i < self->count; i++) leave(&self->worlds[i]);
  if (self->slots != NULL) vehicle_sensors_free_room(self);
  free(self->worlds);
  free(self->slots);
  free(self->numbers);
  free(self->readings);
  free(self->brains);
  free(self);
}

int vehicles_place(vehicles *self, size_t i, const arena *where, uint64_t seed, uint32_t id, double x, double y,
                   double heading) {
  const vehicle_model *m = self->model;
  vehicle *w = &self->worlds[i];
  const size_t moving = arena_moving_count(where);
  mover *movers = moving > 0 ? calloc(moving, sizeof *movers) : NULL;
  if (moving > 0 && movers == NULL) return VEHICLE_NO_MEMORY;
  world own;
  world_init(&own, where, m->dt, movers);
  body at;
  body_init(&at, &m->body, m->reach);
  if (!world_is_free(&own, x, y, at.body_reach, id)) {
    free(movers);
    return VEHICLE_NOT_FREE;
  }
  if (!vehicle_sensors_find_room(self, i)) {
    free(movers);
    return VEHICLE_NO_MEMORY;
  }
  leave(w);
  w->all = self;
  w->own = own;
  w->in = &w->own;
  w->member = (world_robot){.body = &w->body, .op = &VEHICLE_OPERATIONS, .owner = w};
  w->own.robots = &w->member;
  w->own.count = 1;
  memset(&self->readings[i * m->readings], 0, m->readings * sizeof *self->readings);
  memset(self->brains + i * self->state_size, 0, self->state_size);
  w->state.seed = seed;
  w->state.id = id;
  w->state.energy = 1.0;
  w->body = at;
  w->body.id = id;
  w->hold = body_wheel_hold(&w->body, m->dt);
  body_place(&w->body, x, y, heading);
  if (m->drive == DRIVE_SERVO) vehicles_set_servos(self, i, &m->servo[0], &m->servo[1]);
  vehicle_sensors_start(self, i);
  vehicles_sense(self, i);
  return VEHICLE_OK;
}

void vehicles_set_servos(vehicles *self, size_t i, const servo_motor_parameters *left,
                         const servo_motor_parameters *right) {
  vehicle *w = &self->worlds[i];
  w->servo[0] = *left;
  w->servo[1] = *right;
  for (int side = 0; side < 2; side++) servo_motor_init(&w->servo[side], &w->state.servos[side], self->model->dt);
}

void vehicles_coast(vehicles *self, size_t i, int coasts) { self->worlds[i].state.coasts = coasts; }

void vehicles_set_speeds(vehicles *self, size_t i, double speed, double turn_rate) {
  body *b = &self->worlds[i].body;
  b->state.speed = speed;
  b->state.turn_rate = turn_rate;
  b->state.lateral = 0.0;
  b->state.rim_left = body_left_speed(b);
  b->state.rim_right = body_right_speed(b);
  b->state.slipping = 0;
}

size_t vehicles_memory(const vehicles *self) {
  const vehicle_model *m = self->model;
  const size_t each =
      sizeof(vehicle) + m->sensors_count * sizeof(sensor_slot) + (m->numbers + m->readings) * sizeof(double);
  return sizeof *self + self->count * (each + self->state_size);
}
