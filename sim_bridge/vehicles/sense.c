/* sense.c: see sense.h. */
#include "sense.h"

#include <math.h>
#include <string.h>

/* ---- memory ------------------------------------------------------------------------------------------------------- */

void vehicle_sensors_give_numbers(vehicles *self) {
  const vehicle_model *m = self->model;
  for (size_t k = 0; k < self->slots_count; k++) {
    const size_t i = k / m->sensors_count, sensor = k % m->sensors_count;
    self->slots[k].memory.numbers = &self->numbers[i * m->numbers + m->sensors[sensor].numbers];
  }
}

int vehicle_sensors_find_room(vehicles *self, size_t i) {
  const vehicle_model *m = self->model;
  sensor_slot *slots = &self->slots[i * m->sensors_count];
  for (size_t k = 0; k < m->sensors_count; k++) {
    const vehicle_sensor *sensor = &m->sensors[k];
    sensor_slot *slot = &slots[k];
    if (sensor->kind->work == NULL || slot->memory.work != NULL) continue;
    slot->free_work = sensor->kind->free_work;
    slot->memory.work = sensor->kind->work(sensor->made);
    if (slot->memory.work == NULL) return 0;
  }
  return 1;
}

void vehicle_sensors_free_room(vehicles *self) {
  for (size_t k = 0; k < self->slots_count; k++) {
    const sensor_slot *slot = &self->slots[k];
    if (slot->memory.work != NULL) slot->free_work(slot->memory.work);
  }
}

/* ---- sensing ------------------------------------------------------------------------------------------------------ */

void vehicles_currents(const vehicles *self, size_t i, double currents[2]) {
  const vehicle_model *m = self->model;
  const vehicle *w = &self->worlds[i];
  const double rims[2] = {body_axis_left(&w->body), body_axis_right(&w->body)};
  for (int side = 0; side < 2; side++) {
    currents[side] = 0.0;
    if (m->drive != DRIVE_DC) continue;
    const motor_dc_parameters *motor = &m->dc[side];
    const double volts = motor_dc_voltage(motor, w->state.signals[side]);
    currents[side] =
        m->full ? w->state.currents[side] : motor_dc_current(motor, volts, rims[side] / m->body.wheel_radius);
  }
}

/* Current of both motors, A. */
static double motor_current(const void *robot) {
  const vehicle *w = robot;
  double currents[2];
  vehicles_currents(w->all, (size_t)(w - w->all->worlds), currents);
  return fabs(currents[0]) + fabs(currents[1]);
}

static sensing sensing_of(vehicle *w, const viewpoint *from) {
  const double dt = w->all->model->dt;
  return (sensing){.from = *from,
                   .body = &w->body,
                   .dt = dt,
                   .time = (double)w->state.step * dt,
                   .acceleration = w->state.acceleration,
                   .energy = w->state.energy,
                   .robot = w,
                   .motor_current = motor_current};
}

void vehicle_sensors_start(vehicles *self, size_t i) {
  const vehicle_model *m = self->model;
  vehicle *w = &self->worlds[i];
  const viewpoint from = vehicle_viewpoint(w);
  const sensing s = sensing_of(w, &from);
  for (size_t k = 0; k < m->sensors_count; k++) {
    const vehicle_sensor *sensor = &m->sensors[k];
    sensor_slot *slot = &self->slots[i * m->sensors_count + k];
    *slot = (sensor_slot){.key = noise_key(w->state.seed, w->state.id, sensor->device),
                          .hold = {.period = sensor->period},
                          .memory = slot->memory,
                          .free_work = slot->free_work};
    memset(slot->memory.numbers, 0, sensor->kind->numbers * sizeof(double));
    if (sensor->kind->start != NULL) sensor->kind->start(sensor->made, &slot->memory, &s);
  }
}

static int is_due(const vehicle_sensor *sensor, const sensor_slot *slot, double time) {
  return !(sensor->period > 0.0) || sample_hold_due(&slot->hold, time);
}

/* Its draws are those of this step. */
static void read_one(vehicles *self, size_t i, size_t number, const sensing *s) {
  const vehicle_model *m = self->model;
  const vehicle_sensor *sensor = &m->sensors[number];
  sensor_slot *slot = &self->slots[i * m->sensors_count + number];
  double *readings = &self->readings[i * m->readings + sensor->first];
  const uint64_t step = self->worlds[i].state.step;
  noise_source noise = {.keyed = 1, .on = m->noise != 0, .key = slot->key};
  noise_at(&noise, step);
  if (sensor->kind->step != NULL && step > 0) sensor->kind->step(sensor->made, &slot->memory, s, &noise);
  if (!is_due(sensor, slot, s->time)) return;
  sensor->kind->read(sensor->made, &slot->memory, s, &noise, readings);
  if (sensor->period > 0.0) sample_hold_take(&slot->hold, s->time, *readings);
}

void vehicles_sense(vehicles *self, size_t i) {
  vehicle *w = &self->worlds[i];
  if (w->state.sensed == w->state.step + 1) return;
  const viewpoint from = vehicle_viewpoint(w);
  const sensing s = sensing_of(w, &from);
  for (size_t number = 0; number < self->model->sensors_count; number++) read_one(self, i, number, &s);
  w->state.sensed = w->state.step + 1;
}
