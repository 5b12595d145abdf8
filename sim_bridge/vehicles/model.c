/* model.c: see model.h. */
#include "model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int positive(double value) { return value > 0.0 && isfinite(value); }

vehicle_model *vehicle_model_new(const body_parameters *parameters, double dt) {
  if (!positive(dt) || body_parameters_wrong(parameters) != NULL) return NULL;
  vehicle_model *self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
  self->body = *parameters;
  self->dt = dt;
  self->noise = self->ends_at_collision = 1;
  return self;
}

void vehicle_model_destroy(vehicle_model *self) { free(self); }

void vehicle_model_switch(vehicle_model *self, int noise, int ends_at_collision) {
  self->noise = noise;
  self->ends_at_collision = ends_at_collision;
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
  const double around = (2.0 * body_b(b) * steeper * b->half_track / b->wheel_radius + b->angular_damping) / b->inertia;
  const double rate = along > around ? along : around;
  if (isnan(along + around)) return 0.0; /* numbers that no arithmetic holds: no step is small enough */
  return rate > 0.0 ? 2.0 / rate : INFINITY;
}

/* A model that steps too far keeps its drive, so that its limit can be asked; vehicles_place refuses it. */
static int check_step(const vehicle_model *self) {
  return self->dt < vehicle_model_euler_limit(self) ? VEHICLE_OK : VEHICLE_BAD_STEP;
}

static int dc_usable(const motor_dc_parameters *m) {
  const double sum = m->torque_constant + m->emf_constant + m->resistance_ohm + m->inductance_h + m->coulomb_n_m +
                     m->viscous_n_m_s + m->gear + m->efficiency + m->torque_maximum_n_m + m->voltage_maximum;
  return isfinite(sum) && m->resistance_ohm > 0.0 && m->gear > 0.0 && m->efficiency > 0.0 && m->inductance_h >= 0.0 &&
         m->torque_constant >= 0.0 && m->emf_constant >= 0.0 && m->coulomb_n_m >= 0.0 && m->viscous_n_m_s >= 0.0 &&
         m->torque_maximum_n_m >= 0.0;
}

int vehicle_model_drive_dc(vehicle_model *self, const motor_dc_parameters *left, const motor_dc_parameters *right,
                           int full) {
  if (self->drive != DRIVE_NONE) return VEHICLE_TOO_MANY;
  if (!dc_usable(left) || !dc_usable(right)) return VEHICLE_BAD_NUMBER;
  self->drive = DRIVE_DC;
  self->dc[0] = *left;
  self->dc[1] = *right;
  self->full = full;
  return check_step(self);
}

static int servo_usable(const servo_motor_parameters *s) {
  const double sum = s->mount + s->wheel_radius + s->centre_us + s->dead_band_us + s->top_ccw_rad_s + s->scale_ccw_us +
                     s->top_cw_rad_s + s->scale_cw_us + s->lag_s + s->motor.gain_n_s + s->motor.torque_maximum_n_m +
                     s->motor.coast_n_s + s->motor.coast_maximum_n_m;
  return isfinite(sum) && s->wheel_radius > 0.0 && s->scale_ccw_us > 0.0 && s->scale_cw_us > 0.0 && s->lag_s >= 0.0;
}

int vehicle_model_drive_servo(vehicle_model *self, const servo_motor_parameters *left,
                              const servo_motor_parameters *right) {
  if (self->drive != DRIVE_NONE) return VEHICLE_TOO_MANY;
  if (!servo_usable(left) || !servo_usable(right)) return VEHICLE_BAD_NUMBER;
  self->drive = DRIVE_SERVO;
  self->servo[0] = *left;
  self->servo[1] = *right;
  return check_step(self);
}

static int regulated_usable(const motor_regulated_parameters *m) {
  const double sum = m->gain_n_s + m->torque_maximum_n_m + m->coast_n_s + m->coast_maximum_n_m + m->speed_maximum_m_s;
  return isfinite(sum) && m->gain_n_s > 0.0 && m->torque_maximum_n_m >= 0.0 && m->speed_maximum_m_s >= 0.0;
}

int vehicle_model_drive_regulated(vehicle_model *self, const motor_regulated_parameters *left,
                                  const motor_regulated_parameters *right) {
  if (self->drive != DRIVE_NONE) return VEHICLE_TOO_MANY;
  if (!regulated_usable(left) || !regulated_usable(right)) return VEHICLE_BAD_NUMBER;
  self->drive = DRIVE_REGULATED;
  self->regulated[0] = *left;
  self->regulated[1] = *right;
  return check_step(self);
}

/* ---- sensors ------------------------------------------------------------------------------------------------------ */

/* A new sensor with that many readings, NULL where there is no room or the period is no time. */
static vehicle_sensor *added(vehicle_model *self, int kind, double period, size_t readings) {
  if (self->sensors_count == VEHICLE_SENSORS || !(period >= 0.0) || !isfinite(period)) return NULL;
  uint32_t number = 0;
  for (size_t i = 0; i < self->sensors_count; i++) number += self->sensors[i].kind == kind;
  vehicle_sensor *sensor = &self->sensors[self->sensors_count++];
  memset(sensor, 0, sizeof *sensor);
  sensor->kind = kind;
  sensor->device = (uint32_t)kind * 64u + number;
  sensor->period = period;
  sensor->first = self->readings;
  self->readings += readings;
  return sensor;
}

/* What adding a sensor returns; one that is not `usable` leaves again. */
static int done(vehicle_model *self, const vehicle_sensor *sensor, int usable, size_t readings) {
  if (sensor == NULL) return self->sensors_count == VEHICLE_SENSORS ? VEHICLE_TOO_MANY : VEHICLE_BAD_NUMBER;
  if (usable) return (int)sensor->first;
  self->sensors_count--;
  self->readings -= readings;
  return VEHICLE_BAD_NUMBER;
}

int vehicle_model_add_infrared_proximity(vehicle_model *self, const infrared_proximity_parameters *p, double period) {
  vehicle_sensor *s = added(self, SENSOR_INFRARED_PROXIMITY, period, 1);
  return done(self, s, s != NULL && infrared_proximity_init(&s->as.infrared_proximity, p) == 0, 1);
}

int vehicle_model_add_sharp_infrared(vehicle_model *self, const sharp_infrared_parameters *p) {
  vehicle_sensor *s = added(self, SENSOR_SHARP_INFRARED, 0.0, 1);
  return done(self, s, s != NULL && sharp_infrared_init(&s->as.sharp_infrared, p) == 0, 1);
}

int vehicle_model_add_sonar(vehicle_model *self, const sonar_parameters *p, double period) {
  vehicle_sensor *s = added(self, SENSOR_SONAR, period, 1);
  return done(self, s, s != NULL && sonar_init(&s->as.sonar, p) == 0, 1);
}

int vehicle_model_add_laser(vehicle_model *self, const laser_parameters *p, double period) {
  if (self->laser != NULL) return VEHICLE_TOO_MANY;
  if (laser_check(p)) return VEHICLE_BAD_NUMBER;
  vehicle_sensor *s = added(self, SENSOR_LASER, period, (size_t)p->rays);
  if (s != NULL) s->as.laser = *p;
  self->laser = s;
  return done(self, s, 1, (size_t)p->rays);
}

int vehicle_model_add_compass(vehicle_model *self, const compass_parameters *p, double period) {
  vehicle_sensor *s = added(self, SENSOR_COMPASS, period, 1);
  if (s != NULL) s->as.compass = *p;
  return done(self, s, s != NULL && compass_check(p) == 0, 1);
}

int vehicle_model_add_accelerometer(vehicle_model *self, const accelerometer_parameters *p, double period) {
  vehicle_sensor *s = added(self, SENSOR_ACCELEROMETER, period, 1);
  if (s != NULL) s->as.accelerometer = *p;
  return done(self, s, s != NULL && accelerometer_check(p) == 0, 1);
}

int vehicle_model_add_phototransistor(vehicle_model *self, const phototransistor_parameters *p, double period) {
  vehicle_sensor *s = added(self, SENSOR_PHOTOTRANSISTOR, period, 1);
  return done(self, s, s != NULL && phototransistor_init(&s->as.phototransistor, p) == 0, 1);
}

int vehicle_model_add_odometer(vehicle_model *self, const odometer_parameters *p) {
  vehicle_sensor *s = added(self, SENSOR_ODOMETER, 0.0, 3);
  if (s != NULL) s->as.odometer = *p;
  return done(self, s, s != NULL && odometer_check(p) == 0, 3);
}

int vehicle_model_add_table(vehicle_model *self, const beam_parameters *look, const table_noise *table, double range,
                            double none, double period) {
  vehicle_sensor *s = added(self, SENSOR_TABLE, period, 1);
  int usable = 0;
  if (s != NULL) {
    s->as.table.table = table;
    s->as.table.range = range;
    s->as.table.none = none;
    usable = beam_init(&s->as.table.beam, look) == 0 && positive(range) && isfinite(none) && table != NULL;
  }
  return done(self, s, usable, 1);
}

int vehicle_model_add_whisker(vehicle_model *self, double x0, double y0, double x1, double y1) {
  vehicle_sensor *s = added(self, SENSOR_WHISKER, 0.0, 1);
  const double reach = sqrt(fmax(x0 * x0 + y0 * y0, x1 * x1 + y1 * y1));
  if (s != NULL) s->as.whisker = (whisker_segment){x0, y0, x1, y1};
  const int usable = isfinite(x0 + y0 + x1 + y1) && isfinite(reach);
  if (usable && reach > self->reach) self->reach = reach;
  return done(self, s, usable, 1);
}

int vehicle_model_battery(vehicle_model *self, const energy_parameters *energy, double empty, double full,
                          double sigma) {
  if (self->has_battery) return VEHICLE_TOO_MANY;
  const double sum = energy->idle_per_s + energy->signal_per_s + energy->charger_per_s + empty + full + sigma;
  vehicle_sensor *s = added(self, SENSOR_BATTERY, 0.0, 1);
  if (s != NULL) s->as.battery = (battery_gauge){empty, full, sigma};
  self->energy = *energy;
  self->has_battery = s != NULL && isfinite(sum) && sigma >= 0.0;
  return done(self, s, self->has_battery, 1);
}
