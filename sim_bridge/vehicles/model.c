/* model.c: see model.h. */
#include "model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

vehicle_model *vehicle_model_new(const body_parameters *parameters, double dt) {
  vehicle_model *self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
  self->body = *parameters;
  self->dt = dt;
  self->noise = self->ends_at_collision = 1;
  return self;
}

void vehicle_model_destroy(vehicle_model *self) {
  for (size_t i = 0; i < self->sensors_count; i++) free(self->sensors[i].made);
  free(self->sensors);
  free(self);
}

/* ---- drive -------------------------------------------------------------------------------------------------------- */

/* Torque that one wheel loses per rad/s of its speed, N m s. */
static double slope(const vehicle_model *self, int side) {
  if (self->drive == DRIVE_SERVO) return self->servo[side].motor.gain_n_s * self->body.wheel_radius; /* (3.15) */
  if (self->drive == DRIVE_REGULATED) return self->regulated[side].gain_n_s * self->body.wheel_radius;
  if (self->drive != DRIVE_DC) return 0.0;
  const motor_dc_parameters *m = &self->dc[side];
  const double motor = m->torque_constant * m->emf_constant / m->resistance_ohm + m->viscous_n_m_s; /* (1.8), (1.9) */
  return m->gear * m->gear * m->efficiency * motor;
}

double vehicle_model_euler_limit(const vehicle_model *self) {
  const body_parameters *b = &self->body;
  const double steeper = slope(self, 0) > slope(self, 1) ? slope(self, 0) : slope(self, 1);
  const double along = (2.0 * body_a(b) * steeper / b->wheel_radius + b->linear_damping) / b->mass;
  const double axis = body_axis_half_track(b) / b->wheel_radius;
  const double around = (2.0 * body_b(b) * steeper * axis + b->angular_damping) / b->inertia;
  const double rate = along > around ? along : around;
  if (isnan(along + around)) return 0.0; /* numbers that no arithmetic holds: no step is small enough */
  return rate > 0.0 ? 2.0 / rate : INFINITY;
}

void vehicle_model_drive_dc(vehicle_model *self, const motor_dc_parameters *left, const motor_dc_parameters *right,
                            int full) {
  self->drive = DRIVE_DC;
  self->dc[0] = *left;
  self->dc[1] = *right;
  self->full = full;
}

void vehicle_model_drive_servo(vehicle_model *self, const servo_motor_parameters *left,
                               const servo_motor_parameters *right) {
  self->drive = DRIVE_SERVO;
  self->servo[0] = *left;
  self->servo[1] = *right;
}

void vehicle_model_board(vehicle_model *self, const motion_map *left, const motion_map *right) {
  self->has_board = 1;
  self->motion[0] = *left;
  self->motion[1] = *right;
}

void vehicle_model_drive_regulated(vehicle_model *self, const motor_regulated_parameters *left,
                                   const motor_regulated_parameters *right) {
  self->drive = DRIVE_REGULATED;
  self->regulated[0] = *left;
  self->regulated[1] = *right;
}

/* ---- battery and sensors ------------------------------------------------------------------------------------------ */

void vehicle_model_battery(vehicle_model *self, const energy_parameters *energy) {
  self->energy = *energy;
  self->has_battery = 1;
}

/* Key of the noise of a kind's `number`-th sensor: a block of 64 for each kind, and the next 64 of all kinds above them. */
static uint32_t device_of(const sensor_kind *kind, uint32_t number) {
  return kind->noise * 64u + number % 64u + (number / 64u << 16);
}

int vehicle_model_add(vehicle_model *self, const sensor_kind *kind, const void *parameters, double period) {
  vehicle_sensor *sensors = realloc(self->sensors, (self->sensors_count + 1) * sizeof *sensors);
  if (sensors == NULL) return VEHICLE_NO_MEMORY;
  self->sensors = sensors;
  void *made = calloc(1, kind->size);
  if (made == NULL) return VEHICLE_NO_MEMORY;
  if (kind->make == NULL) memcpy(made, parameters, kind->size);
  const size_t readings = kind->make == NULL ? kind->readings : kind->make(made, parameters);
  if (readings == 0) {
    free(made);
    return VEHICLE_BAD_NUMBER;
  }
  uint32_t number = 0;
  for (size_t i = 0; i < self->sensors_count; i++) number += self->sensors[i].kind == kind;
  self->sensors[self->sensors_count++] = (vehicle_sensor){.kind = kind,
                                                          .device = device_of(kind, number),
                                                          .first = self->readings,
                                                          .numbers = self->numbers,
                                                          .period = period,
                                                          .made = made};
  self->numbers += kind->numbers;
  if (kind->reach != NULL) self->reach = fmax(self->reach, kind->reach(made));
  self->readings += readings;
  return (int)(self->readings - readings);
}
