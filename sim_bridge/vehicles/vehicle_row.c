/* vehicle_row.c: see vehicle_row.h. Motors (1.8)-(1.10), IR proximity sensors (3.10)-(3.13), odometer (2.7)-(2.9) and compass
 * of a row are computed together; what a model has beside them, each world computes alone. */
#include "vehicle_row.h"

#include <string.h>

#include "../world/body_step.h"
#include "../world/row.h"
#include "../world/sensors/compass.h"
#include "../world/sensors/infrared_proximity.h"
#include "../world/sensors/odometer.h"
#include "sense.h"

/* ---- moving -------------------------------------------------------------------------------------------------------- */

static void dc_torques(const vehicle_model *m, vehicle *const worlds[], double left[], double right[]) {
  const motor_dc_parameters motors[2] = {m->dc[0], m->dc[1]}; /* here, where no result can be */
  const double radius = m->body.wheel_radius;
  const double stopping[2] = {motor_dc_stopping(&motors[0], worlds[0]->hold),
                              motor_dc_stopping(&motors[1], worlds[0]->hold)};
  double signals[2][ROW], rims[2][ROW];
  for (size_t k = 0; k < ROW; k++) {
    signals[0][k] = worlds[k]->state.signals[0];
    signals[1][k] = worlds[k]->state.signals[1];
    rims[0][k] = body_axis_left(&worlds[k]->body);
    rims[1][k] = body_axis_right(&worlds[k]->body);
  }
  for (size_t k = 0; k < ROW; k++)
    left[k] = vehicle_dc_torque(&motors[0], radius, signals[0][k], rims[0][k], stopping[0]);
  for (size_t k = 0; k < ROW; k++)
    right[k] = vehicle_dc_torque(&motors[1], radius, signals[1][k], rims[1][k], stopping[1]);
}

static void torques(const vehicles *self, vehicle *const worlds[], double left[], double right[]) {
  if (self->model->drive == DRIVE_DC && !self->model->full) {
    dc_torques(self->model, worlds, left, right);
    return;
  }
  for (size_t k = 0; k < ROW; k++) {
    double torque[2];
    VEHICLE_OPERATIONS.torques(worlds[k], torque);
    left[k] = torque[0];
    right[k] = torque[1];
  }
}

static void move(vehicles *self, const size_t row[], vehicle *const worlds[]) {
  double left[ROW], right[ROW];
  scene around[ROW];
  body *bodies[ROW];
  for (size_t k = 0; k < ROW; k++) {
    worlds[k]->speed_before = worlds[k]->body.state.speed;
    around[k] = world_obstacles(&worlds[k]->own);
    bodies[k] = &worlds[k]->body;
  }
  torques(self, worlds, left, right);
  body_advance_row(bodies, around, left, right, self->model->dt);
  for (size_t k = 0; k < ROW; k++) {
    worlds[k]->own.steps++;
    vehicle_moved(worlds[k]);
    world_update(&worlds[k]->own);
    vehicles_check(self, row[k]);
  }
}

/* ---- sensing ------------------------------------------------------------------------------------------------------- */

/* Worlds that sense, and the draws of the sensor that is read. */
typedef struct {
  vehicles *all;
  const size_t *row;
  vehicle *const *worlds;
  viewpoint from[ROW];
  sensor_slot *slots[ROW]; /* of the first sensor */
  double *readings[ROW];
  double draws[2][ROW]; /* sensors take one number each, an odometer two */
} sensing_row;

/* How many normal draws a sensor takes of which the whole row is read at once; 0: it is read for each world alone. */
static unsigned draws_of(const vehicle_sensor *sensor) {
  if (sensor->period > 0.0) return 0;
  if (sensor->kind == infrared_proximity_sensor) return !((const infrared_proximity *)sensor->made)->reflectance;
  if (sensor->kind == compass_sensor) return !compass_is_disturbed(sensor->made);
  return sensor->kind == odometer_sensor && odometer_is_plain(sensor->made) ? 2 : 0;
}

/* A sensor's draws in each world of the row; 0 without noise. */
static void draw(sensing_row *s, size_t number, unsigned draws) {
  const int noise = s->all->model->noise;
  for (unsigned i = 0; i < draws; i++) {
    for (size_t k = 0; k < ROW; k++) {
      const uint64_t step = noise_first(s->worlds[k]->state.step) + i;
      s->draws[i][k] = noise ? noise_normal_of(hash_mix(s->slots[k][number].key ^ step)) : 0.0;
    }
  }
}

static void finish_eyes(const infrared_proximity *eye, const double (*distances)[BEAM_RAYS], const double draws[],
                        double readings[]) {
  double sums[ROW] = {0.0};
  double seen[ROW];
  for (int i = 0; i < eye->beam.rays; i++) {
    const double inward = eye->beam.inward[i];
    double distance[ROW];
    for (size_t k = 0; k < ROW; k++) distance[k] = distances[k][i];
    for (size_t k = 0; k < ROW; k++) sums[k] += infrared_proximity_ray(eye->c1, eye->c2, distance[k], inward);
  }
  for (size_t k = 0; k < ROW; k++) seen[k] = infrared_proximity_of(eye, sums[k], draws[k]);
  memcpy(readings, seen, sizeof seen);
}

static void read_eyes(const sensing_row *s, const vehicle_sensor *sensor) {
  const infrared_proximity *eye = sensor->made;
  fan_question asked[ROW];
  double distances[ROW][BEAM_RAYS];
  double readings[ROW];
  for (size_t k = 0; k < ROW; k++) asked[k] = infrared_proximity_ask(eye, &s->from[k], distances[k]);
  arena_fans(asked, ROW);
  for (size_t k = 0; k < ROW; k++) {
    if (s->from[k].around->movers_count > 0) scene_fan_movers(s->from[k].around, &asked[k], s->from[k].id);
  }
  finish_eyes(eye, (const double(*)[BEAM_RAYS])distances, s->draws[0], readings);
  for (size_t k = 0; k < ROW; k++) s->readings[k][sensor->first] = readings[k];
}

static void read_compasses(const sensing_row *s, const vehicle_sensor *sensor) {
  double readings[ROW];
  for (size_t k = 0; k < ROW; k++) readings[k] = s->from[k].heading;
  for (size_t k = 0; k < ROW; k++) readings[k] = compass_of(sensor->made, readings[k], s->draws[0][k]);
  for (size_t k = 0; k < ROW; k++) s->readings[k][sensor->first] = readings[k];
}

static void read_odometers(const sensing_row *s, const vehicle_sensor *sensor) {
  const odometer_parameters parameters = *(const odometer_parameters *)sensor->made;
  const odometer_parameters *p = &parameters; /* here, where no result can be */
  const size_t number = (size_t)(sensor - s->all->model->sensors);
  const double spread = p->sigma_step > 0.0 ? odometer_spread(p, s->all->model->dt) : 0.0;
  const double share = odometer_share(p);
  odometer_state *states[ROW];
  const body_state *bodies[ROW];
  double left[ROW], right[ROW], x[ROW], y[ROW], heading[ROW], distance[ROW];
  for (size_t k = 0; k < ROW; k++) {
    states[k] = (odometer_state *)s->slots[k][number].memory.numbers;
    bodies[k] = &s->worlds[k]->body.state;
  }
  for (size_t k = 0; k < ROW; k++) {
    left[k] = bodies[k]->wheel_left - states[k]->wheel_left;
    right[k] = bodies[k]->wheel_right - states[k]->wheel_right;
    x[k] = states[k]->x;
    y[k] = states[k]->y;
    heading[k] = states[k]->heading;
    distance[k] = states[k]->distance;
  }
  for (size_t k = 0; k < ROW; k++) {
    left[k] = odometer_travel(p, left[k], p->factor_left) + spread * s->draws[0][k];
    right[k] = odometer_travel(p, right[k], p->factor_right) + spread * s->draws[1][k];
    odometer_lay_off(p->half_track, share, left[k], right[k], &x[k], &y[k], &heading[k], &distance[k]);
  }
  for (size_t k = 0; k < ROW; k++) {
    odometer_state *state = states[k];
    double *readings = &s->readings[k][sensor->first];
    state->wheel_left = bodies[k]->wheel_left;
    state->wheel_right = bodies[k]->wheel_right;
    readings[0] = state->x = x[k];
    readings[1] = state->y = y[k];
    readings[2] = state->heading = heading[k];
    state->distance = distance[k];
  }
}

static void sense(vehicles *self, const size_t row[], vehicle *const worlds[]) {
  const vehicle_model *m = self->model;
  sensing_row s;
  s.all = self;
  s.row = row;
  s.worlds = worlds;
  for (size_t k = 0; k < ROW; k++) {
    s.from[k] = vehicle_viewpoint(worlds[k]);
    s.slots[k] = &self->slots[row[k] * m->sensors_count];
    s.readings[k] = &self->readings[row[k] * m->readings];
  }
  for (size_t number = 0; number < m->sensors_count; number++) {
    const vehicle_sensor *sensor = &m->sensors[number];
    const unsigned draws = draws_of(sensor);
    for (size_t k = 0; k < ROW && draws == 0; k++) vehicle_sense_one(self, row[k], number, &s.from[k]);
    if (draws == 0) continue;
    draw(&s, number, draws);
    if (sensor->kind == infrared_proximity_sensor) read_eyes(&s, sensor);
    if (sensor->kind == compass_sensor) read_compasses(&s, sensor);
    if (sensor->kind == odometer_sensor) read_odometers(&s, sensor);
  }
  for (size_t k = 0; k < ROW; k++) worlds[k]->state.sensed = worlds[k]->state.step + 1;
}

void vehicle_row_step(vehicles *self, const size_t row[]) {
  vehicle *worlds[ROW];
  for (size_t k = 0; k < ROW; k++) worlds[k] = &self->worlds[row[k]];
  move(self, row, worlds);
  sense(self, row, worlds);
}
