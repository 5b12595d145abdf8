/* sense.c: see sense.h. */
#include "sense.h"

#include <math.h>
#include <string.h>

#include "geometry/numbers.h"

typedef struct {
  vehicles *all;
  vehicle *world;
  viewpoint from;
  double time;
} sensing;

void vehicle_sensors_start(vehicles *self, size_t i) {
  const vehicle_model *m = self->model;
  const vehicle *w = &self->worlds[i];
  sensor_slot *slots = &self->slots[i * m->sensors_count];
  memset(slots, 0, m->sensors_count * sizeof *slots);
  for (size_t k = 0; k < m->sensors_count; k++) {
    const vehicle_sensor *sensor = &m->sensors[k];
    slots[k].key = noise_key(w->state.seed, w->state.id, sensor->device);
    slots[k].hold.period = sensor->period;
    if (sensor->kind == SENSOR_ODOMETER) {
      const body_state *b = &w->body.state;
      odometer_calibrate(&slots[k].as.odometer, b->x, b->y, b->heading, b->wheel_left, b->wheel_right);
    }
  }
}

/* Current of both motors, A. */
static double motor_current(const sensing *s) {
  double currents[2];
  vehicles_currents(s->all, (size_t)(s->world - s->all->worlds), currents);
  return fabs(currents[0]) + fabs(currents[1]);
}

static double table_reading(const table_sensor *t, const viewpoint *from, noise_source *noise) {
  const beam_origin at = beam_from(&t->beam, from);
  double nearest = -1.0;
  double angle = 0.0;
  for (int i = 0; i < t->beam.rays; i++) {
    ray_hit hit;
    const double d = beam_ray(&t->beam, from, at, i, nearest < 0.0 ? t->range : nearest, &hit);
    if (d < 0.0) continue;
    double cosine, sine;
    beam_direction(&t->beam, from, i, &cosine, &sine);
    const double along = -(cosine * hit.normal_x + sine * hit.normal_y);
    const double across = cosine * hit.normal_y - sine * hit.normal_x;
    nearest = d;
    angle = number_atan2(fabs(across), along);
  }
  return nearest < 0.0 ? t->none : table_noise_read(t->table, nearest, angle, noise);
}

static void read_odometer(const sensing *s, const odometer_parameters *p, odometer_state *state, noise_source *noise,
                          double *out) {
  const body_state *b = &s->world->body.state;
  if (s->world->state.step > 0) odometer_step(p, state, b->wheel_left, b->wheel_right, s->all->model->dt, noise);
  out[0] = state->x;
  out[1] = state->y;
  out[2] = state->heading;
}

static void read(const sensing *s, const vehicle_sensor *sensor, sensor_slot *slot, noise_source *noise, double *out) {
  switch (sensor->kind) {
    case SENSOR_INFRARED_PROXIMITY:
      *out = infrared_proximity_read(&sensor->as.infrared_proximity, &s->from, noise);
      break;
    case SENSOR_SHARP_INFRARED:
      *out = sharp_infrared_read(&sensor->as.sharp_infrared, &slot->as.sharp_infrared, &s->from, s->time, noise);
      break;
    case SENSOR_SONAR:
      *out = sonar_read(&sensor->as.sonar, &s->from, noise);
      break;
    case SENSOR_LASER:
      laser_scan(s->world->laser, &s->from, noise, out);
      break;
    case SENSOR_COMPASS: {
      const compass_parameters *c = &sensor->as.compass;
      *out = compass_read(c, &s->from, c->current_x != 0.0 || c->current_y != 0.0 ? motor_current(s) : 0.0, noise);
      break;
    }
    case SENSOR_ACCELEROMETER:
      *out = accelerometer_read(&sensor->as.accelerometer, &slot->as.accelerometer, noise);
      break;
    case SENSOR_PHOTOTRANSISTOR:
      *out = phototransistor_read(&sensor->as.phototransistor, &s->from, noise);
      break;
    case SENSOR_ODOMETER:
      read_odometer(s, &sensor->as.odometer, &slot->as.odometer, noise, out);
      break;
    case SENSOR_TABLE:
      *out = table_reading(&sensor->as.table, &s->from, noise);
      break;
    case SENSOR_WHISKER: {
      const whisker_segment *w = &sensor->as.whisker;
      const int touches =
          body_segment_touches(&s->world->body, s->from.around, w->x0, w->y0, w->x1, w->y1, WHISKER_HEIGHT_M);
      *out = touches ? 1.0 : 0.0;
      break;
    }
    default: {
      const battery_gauge *g = &sensor->as.battery;
      const double noisy = g->sigma > 0.0 ? g->sigma * noise_next_normal(noise) : 0.0;
      *out = g->empty + s->world->state.energy * (g->full - g->empty) + noisy;
      break;
    }
  }
}

static int due(const vehicle_sensor *sensor, const sensor_slot *slot, double time) {
  return !(sensor->period > 0.0) || sample_hold_due(&slot->hold, time);
}

/* From here on a sensor's draws are those of this step. */
static void key_noise(noise_source *noise, const sensor_slot *slot, uint64_t step) {
  noise->key = slot->key;
  noise_at(noise, step);
}

static void read_one(const sensing *s, size_t number, sensor_slot *slots, noise_source *noise, double *readings) {
  const vehicle_model *m = s->all->model;
  const vehicle_state *state = &s->world->state;
  const vehicle_sensor *sensor = &m->sensors[number];
  sensor_slot *slot = &slots[number];
  if (sensor->kind == SENSOR_ACCELEROMETER && state->step > 0)
    accelerometer_step(&sensor->as.accelerometer, &slot->as.accelerometer, state->acceleration, m->dt);
  if (!due(sensor, slot, s->time)) return;
  key_noise(noise, slot, state->step);
  read(s, sensor, slot, noise, &readings[sensor->first]);
  if (sensor->period > 0.0) sample_hold_take(&slot->hold, s->time, readings[sensor->first]);
}

void vehicle_sense_one(vehicles *self, size_t i, size_t number, const viewpoint *from) {
  const vehicle_model *m = self->model;
  vehicle *w = &self->worlds[i];
  const sensing s = {.all = self, .world = w, .from = *from, .time = (double)w->state.step * m->dt};
  noise_source noise = {.keyed = 1, .on = m->noise != 0};
  read_one(&s, number, &self->slots[i * m->sensors_count], &noise, &self->readings[i * m->readings]);
}

void vehicle_sense(vehicles *self, size_t i) {
  const vehicle_model *m = self->model;
  vehicle *w = &self->worlds[i];
  if (w->state.sensed == w->state.step + 1) return;
  const sensing s = {.all = self, .world = w, .from = vehicle_viewpoint(w), .time = (double)w->state.step * m->dt};
  double *readings = &self->readings[i * m->readings];
  sensor_slot *slots = &self->slots[i * m->sensors_count];
  noise_source noise = {.keyed = 1, .on = m->noise != 0};
  for (size_t number = 0; number < m->sensors_count; number++) read_one(&s, number, slots, &noise, readings);
  w->state.sensed = w->state.step + 1;
}
