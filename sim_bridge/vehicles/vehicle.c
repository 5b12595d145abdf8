/* vehicle.c: see vehicle.h. */
#include "vehicle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "geometry/numbers.h"
#include "sense.h"
#include "vehicle_row.h"

#define SERVO_PERIOD_S 0.020
#define SPEED_LIMIT 100.0 /* m/s: as body.c limits it */
#define TURN_LIMIT 1000.0 /* rad/s */

vehicles *vehicles_new(const vehicle_model *model, size_t count, size_t state_size) {
  if (state_size > SIZE_MAX - 15u) return NULL;
  const size_t block = (state_size + 15u) & ~(size_t)15u; /* every brain's memory is aligned for any type */
  vehicles *self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
  self->model = model;
  self->count = count;
  self->state_size = block;
  self->worlds = calloc(count + 1, sizeof *self->worlds);
  self->slots = calloc(count * model->sensors_count + 1, sizeof *self->slots);
  self->readings = calloc(count * model->readings + 1, sizeof *self->readings);
  self->brains = calloc(count + 1, block + 1);
  if (self->worlds != NULL && self->slots != NULL && self->readings != NULL && self->brains != NULL) return self;
  vehicles_destroy(self);
  return NULL;
}

/* Frees what a world has of its own. */
static void leave(vehicle *w) {
  free(w->own.movers);
  laser_destroy(w->laser);
  memset(w, 0, sizeof *w);
}

void vehicles_destroy(vehicles *self) {
  if (self == NULL) return;
  for (size_t i = 0; self->worlds != NULL && i < self->count; i++) leave(&self->worlds[i]);
  free(self->worlds);
  free(self->slots);
  free(self->readings);
  free(self->brains);
  free(self);
}

int vehicles_place(vehicles *self, size_t i, const arena *where, uint64_t seed, uint32_t id, double x, double y,
                   double heading) {
  const vehicle_model *m = self->model;
  if (m->drive == DRIVE_NONE || i >= self->count) return VEHICLE_NOT_PLACED;
  if (!(m->dt < vehicle_model_euler_limit(m))) return VEHICLE_BAD_STEP;
  if (!(fabs(x) <= ARENA_FARTHEST_M && fabs(y) <= ARENA_FARTHEST_M && fabs(heading) <= BODY_HEADING_LIMIT))
    return VEHICLE_BAD_NUMBER;
  if (id == 0 || id >= SCENE_FIRST_MOVER) return VEHICLE_BAD_NUMBER;
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
  laser *eye = m->laser != NULL ? laser_new(&m->laser->as.laser) : NULL;
  if (m->laser != NULL && eye == NULL) {
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
  w->laser = eye;
  memset(&self->readings[i * m->readings], 0, m->readings * sizeof *self->readings);
  memset(self->brains + i * self->state_size, 0, self->state_size);
  w->state.seed = seed;
  w->state.id = id;
  w->state.energy = 1.0;
  w->body = at;
  w->body.id = id;
  w->hold = body_wheel_hold(&w->body, m->dt);
  body_place(&w->body, x, y, heading);
  for (int side = 0; side < 2 && m->drive == DRIVE_SERVO; side++)
    servo_motor_init(&m->servo[side], &w->state.servos[side], m->dt);
  vehicle_sensors_start(self, i);
  vehicle_sense(self, i);
  return VEHICLE_OK;
}

int vehicles_set_speeds(vehicles *self, size_t i, double speed, double turn_rate) {
  if (i >= self->count || self->worlds[i].in == NULL) return VEHICLE_NOT_PLACED;
  if (!(fabs(speed) < SPEED_LIMIT) || !(fabs(turn_rate) < TURN_LIMIT)) return VEHICLE_BAD_NUMBER;
  body *b = &self->worlds[i].body;
  b->state.speed = speed;
  b->state.turn_rate = turn_rate;
  b->state.lateral = 0.0;
  b->state.rim_left = body_left_speed(b);
  b->state.rim_right = body_right_speed(b);
  b->state.slipping = 0;
  return VEHICLE_OK;
}

/* ---- the stages of a step ----------------------------------------------------------------------------------------- */

void vehicles_sense(vehicles *self, size_t i) { vehicle_sense(self, i); }

int vehicles_send(vehicles *self, size_t i, double left, double right) {
  if (!isfinite(left) || !isfinite(right)) return VEHICLE_BAD_NUMBER;
  self->worlds[i].state.signals[0] = number_limited(left, 1.0);
  self->worlds[i].state.signals[1] = number_limited(right, 1.0);
  return VEHICLE_OK;
}

/* Torques of both wheels for the next step. */
static void torques(const vehicle_model *m, vehicle *w, double out[2]) {
  vehicle_state *s = &w->state;
  const double rims[2] = {w->body.state.rim_left, w->body.state.rim_right};
  if (m->drive == DRIVE_DC) {
    for (int side = 0; side < 2; side++) {
      const motor_dc_parameters *motor = &m->dc[side];
      const double speed = rims[side] / m->body.wheel_radius;
      out[side] = m->full ? motor_dc_step(motor, &s->currents[side], motor_dc_voltage(motor, s->signals[side]), speed,
                                          w->hold, m->dt)
                          : vehicle_dc_torque(motor, m->body.wheel_radius, s->signals[side], rims[side],
                                              motor_dc_stopping(motor, w->hold));
    }
    return;
  }
  if (m->drive == DRIVE_REGULATED) {
    for (int side = 0; side < 2; side++) {
      const motor_regulated_parameters *motor = &m->regulated[side];
      out[side] = motor_regulated(motor, motor_regulated_reference(motor, s->signals[side]), rims[side], 1.0);
    }
    return;
  }
  const int pulse = s->step >= s->next_pulse;
  for (int side = 0; side < 2; side++) {
    const servo_motor_parameters *servo = &m->servo[side];
    if (pulse) servo_motor_pulse(servo, &s->servos[side], servo_motor_pulse_of(servo, s->signals[side]));
    out[side] = servo_motor_torque(servo, &s->servos[side], rims[side], 1.0);
  }
  if (pulse) s->next_pulse = s->step + (m->dt < SERVO_PERIOD_S ? (uint64_t)(SERVO_PERIOD_S / m->dt + 0.5) : 1u);
}

static size_t index_of(const vehicle *w) { return (size_t)(w - w->all->worlds); }

static void begin_step(void *owner, double out[2]) {
  vehicle *w = owner;
  vehicle_sense(w->all, index_of(w)); /* in a world of several nobody may have asked yet */
  if (w->state.flag != VEHICLE_RUNS) (void)vehicles_send(w->all, index_of(w), 0.0, 0.0);
  w->speed_before = w->body.state.speed;
  torques(w->all->model, w, out);
}

void vehicle_moved(vehicle *self) {
  self->state.acceleration = (self->body.state.speed - self->speed_before) / self->all->model->dt;
  self->state.step++;
}

static void has_moved(void *owner) { vehicle_moved(owner); }

static void end_step(void *owner) {
  vehicle *w = owner;
  (void)vehicles_check(w->all, index_of(w));
  vehicle_sense(w->all, index_of(w));
}

const world_robot_operations VEHICLE_OPERATIONS = {.torques = begin_step, .moved = has_moved, .sense = end_step};

void vehicles_move(vehicles *self, size_t i) { world_move(&self->worlds[i].own); }

void vehicles_update_arena(vehicles *self, size_t i) { world_update(&self->worlds[i].own); }

int vehicles_check(vehicles *self, size_t i) {
  const vehicle_model *m = self->model;
  vehicle_state *s = &self->worlds[i].state;
  const body_state *b = &self->worlds[i].body.state;
  const int at_charger = m->has_battery && arena_is_at_charger(self->worlds[i].in->arena, b->x, b->y);
  if (m->has_battery) s->energy = energy_step(&m->energy, s->energy, s->signals[0], s->signals[1], at_charger, m->dt);
  if (m->ends_at_collision && self->worlds[i].body.state.touching) {
    s->flag = VEHICLE_COLLIDED;
  } else if (m->has_battery && s->energy <= 0.0) {
    s->flag = VEHICLE_EXHAUSTED;
  }
  return s->flag;
}

/* From motor signals that were sent to the next readings. */
static void finish_step(vehicles *self, size_t i) { world_step(&self->worlds[i].own); }

static int ready(const vehicles *self, size_t first, size_t count) {
  if (first > self->count || count > self->count - first) return 0;
  for (size_t i = first; i < first + count; i++) {
    if (self->worlds[i].in == NULL) return 0;
  }
  return 1;
}

/* ---- stepping ----------------------------------------------------------------------------------------------------- */

int vehicles_step_one(vehicles *self, size_t i, double left, double right) {
  if (i >= self->count || self->worlds[i].in == NULL) return VEHICLE_NOT_PLACED;
  const int status = vehicles_send(self, i, left, right);
  if (status != VEHICLE_OK) return status;
  if (self->worlds[i].state.flag == VEHICLE_RUNS) finish_step(self, i);
  return self->worlds[i].state.flag;
}

/* Motor signals of a world's next step: from its brain; without one they hold. Returns VEHICLE_OK, or that the run of a
 * world whose brain failed has ended. */
static int command(vehicles *self, size_t i, vehicle_brain *brain) {
  if (brain == NULL) return VEHICLE_OK;
  double signals[2] = {0.0, 0.0};
  brain(self->brains + i * self->state_size, &self->readings[i * self->model->readings], signals);
  const int sent = vehicles_send(self, i, signals[0], signals[1]);
  if (sent != VEHICLE_OK) self->worlds[i].state.flag = VEHICLE_BRAIN_FAILED;
  return sent;
}

static int runs(const vehicles *self, size_t i) { return self->worlds[i].state.flag == VEHICLE_RUNS; }

/* Steps of one world until its run ends. */
static int run_alone(vehicles *self, size_t i, vehicle_brain *brain, size_t steps) {
  for (size_t step = 0; step < steps && runs(self, i); step++) {
    const int sent = command(self, i, brain);
    if (sent != VEHICLE_OK) return sent;
    finish_step(self, i);
  }
  return VEHICLE_OK;
}

/* Steps of ROW worlds that run, side by side until a run ends. */
static int run_row(vehicles *self, const size_t row[], vehicle_brain *brain, size_t steps) {
  int status = VEHICLE_OK;
  int all_run = 1;
  size_t left = steps;
  for (; left > 0 && all_run; left--) {
    for (size_t k = 0; k < ROW; k++) {
      const int sent = command(self, row[k], brain);
      if (sent != VEHICLE_OK) status = sent;
      all_run &= sent == VEHICLE_OK;
    }
    if (all_run) vehicle_row_step(self, row);
    for (size_t k = 0; k < ROW; k++) {
      if (!all_run && runs(self, row[k])) finish_step(self, row[k]);
    }
    for (size_t k = 0; k < ROW; k++) all_run &= runs(self, row[k]);
  }
  for (size_t k = 0; k < ROW && left > 0; k++) {
    const int ran = run_alone(self, row[k], brain, left);
    if (ran != VEHICLE_OK) status = ran;
  }
  return status;
}

/* Worlds that run are taken into rows; the last few go alone. */
static int run_all(vehicles *self, size_t first, size_t count, vehicle_brain *brain, size_t steps) {
  int status = VEHICLE_OK;
  size_t row[ROW];
  size_t waiting = 0;
  for (size_t i = first; i < first + count; i++) {
    if (runs(self, i)) row[waiting++] = i;
    if (waiting < ROW) continue;
    const int ran = run_row(self, row, brain, steps);
    if (ran != VEHICLE_OK) status = ran;
    waiting = 0;
  }
  for (size_t k = 0; k < waiting; k++) {
    const int ran = run_alone(self, row[k], brain, steps);
    if (ran != VEHICLE_OK) status = ran;
  }
  return status;
}

int vehicles_step(vehicles *self, size_t first, size_t count, const double *signals, size_t steps) {
  if (!ready(self, first, count)) return VEHICLE_NOT_PLACED;
  for (size_t i = 0; i < 2 * count; i++) {
    if (!isfinite(signals[i])) return VEHICLE_BAD_NUMBER;
  }
  for (size_t k = 0; k < count; k++) (void)vehicles_send(self, first + k, signals[2 * k], signals[2 * k + 1]);
  return run_all(self, first, count, NULL, steps);
}

int vehicles_run(vehicles *self, size_t first, size_t count, vehicle_brain *brain, size_t steps) {
  return ready(self, first, count) ? run_all(self, first, count, brain, steps) : VEHICLE_NOT_PLACED;
}

/* ---- what can be asked -------------------------------------------------------------------------------------------- */

double *vehicles_readings(vehicles *self) { return self->readings; }

size_t vehicles_reading_count(const vehicles *self) { return self->model->readings; }

void *vehicles_brain_state(vehicles *self, size_t i) { return self->brains + i * self->state_size; }

void vehicles_poses(const vehicles *self, size_t first, size_t count, double *poses) {
  for (size_t k = 0; k < count; k++) {
    const body_state *b = &self->worlds[first + k].body.state;
    poses[3 * k] = b->x;
    poses[3 * k + 1] = b->y;
    poses[3 * k + 2] = b->heading;
  }
}

void vehicles_flags(const vehicles *self, size_t first, size_t count, int8_t *flags) {
  for (size_t k = 0; k < count; k++) flags[k] = (int8_t)self->worlds[first + k].state.flag;
}

const body_state *vehicles_body(const vehicles *self, size_t i) { return &self->worlds[i].body.state; }

const mover *vehicles_movers(const vehicles *self, size_t i, size_t *count) {
  const world *own = &self->worlds[i].own;
  *count = own->obstacles;
  return own->movers;
}

uint64_t vehicles_steps_done(const vehicles *self, size_t i) { return self->worlds[i].state.step; }

double vehicles_energy(const vehicles *self, size_t i) { return self->worlds[i].state.energy; }

void vehicles_currents(const vehicles *self, size_t i, double currents[2]) {
  const vehicle_model *m = self->model;
  const vehicle *w = &self->worlds[i];
  const double rims[2] = {w->body.state.rim_left, w->body.state.rim_right};
  for (int side = 0; side < 2; side++) {
    currents[side] = 0.0;
    if (m->drive != DRIVE_DC) continue;
    const motor_dc_parameters *motor = &m->dc[side];
    const double volts = motor_dc_voltage(motor, w->state.signals[side]);
    currents[side] =
        m->full ? w->state.currents[side] : motor_dc_current(motor, volts, rims[side] / m->body.wheel_radius);
  }
}

size_t vehicles_memory(const vehicles *self) {
  const vehicle_model *m = self->model;
  const size_t each = sizeof(vehicle) + m->sensors_count * sizeof(sensor_slot) + m->readings * sizeof(double);
  return sizeof *self + self->count * (each + self->state_size);
}
