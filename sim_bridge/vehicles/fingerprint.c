/* fingerprint.c: what tells a model from another one: a hash of every parameter of its body, drive, battery and sensors. */
#include "geometry/hash.h"
#include "model.h"

static uint64_t hash_body(uint64_t sum, const body_parameters *b) {
  sum = HASH_NUMBERS(sum, b->mass, b->inertia, b->radius, b->half_track, b->wheel_radius, b->wheel_mass,
                     b->wheel_inertia, b->spin_inertia, b->linear_damping, b->angular_damping, b->grip, b->height);
  sum = hash_word(sum, b->slip != 0);
  return b->outline != NULL ? hash_numbers(sum, b->outline->xy, 2 * b->outline->corners) : sum;
}

static uint64_t hash_dc(uint64_t sum, const motor_dc_parameters *m) {
  return HASH_NUMBERS(sum, m->torque_constant, m->emf_constant, m->resistance_ohm, m->inductance_h, m->coulomb_n_m,
                      m->viscous_n_m_s, m->gear, m->efficiency, m->torque_maximum_n_m, m->voltage_maximum);
}

static uint64_t hash_regulated(uint64_t sum, const motor_regulated_parameters *m) {
  return HASH_NUMBERS(sum, m->gain_n_s, m->torque_maximum_n_m, m->speed_maximum_m_s);
}

static uint64_t hash_servo(uint64_t sum, const servo_motor_parameters *s) {
  const motor_regulated_parameters *m = &s->motor;
  sum = HASH_NUMBERS(sum, s->mount, s->wheel_radius, s->centre_us, s->dead_band_us, s->top_ccw_rad_s, s->scale_ccw_us,
                     s->top_cw_rad_s, s->scale_cw_us, s->lag_s);
  return HASH_NUMBERS(sum, m->gain_n_s, m->torque_maximum_n_m, m->coast_n_s, m->coast_maximum_n_m,
                      m->speed_maximum_m_s);
}

static uint64_t hash_drive(uint64_t sum, const vehicle_model *m) {
  sum = hash_word(hash_word(sum, (uint64_t)m->drive), (uint64_t)(m->full != 0));
  for (int side = 0; side < 2; side++) {
    if (m->drive == DRIVE_DC) sum = hash_dc(sum, &m->dc[side]);
    if (m->drive == DRIVE_SERVO) sum = hash_servo(sum, &m->servo[side]);
    if (m->drive == DRIVE_REGULATED) sum = hash_regulated(sum, &m->regulated[side]);
  }
  return sum;
}

static uint64_t hash_beam(uint64_t sum, const beam *b) {
  const size_t rays = (size_t)b->rays;
  sum = HASH_NUMBERS(sum, b->x, b->y, b->height, b->middle_cosine, b->middle_sine);
  return hash_numbers(hash_numbers(hash_numbers(sum, b->fan.cosine, rays), b->fan.sine, rays), b->inward, rays);
}

static uint64_t hash_laser(uint64_t sum, const laser_parameters *p) {
  sum = hash_word(sum, (uint64_t)p->rays);
  return HASH_NUMBERS(sum, p->x, p->y, p->heading, p->height, p->first, p->step, p->range, p->sigma);
}

static uint64_t hash_odometer(uint64_t sum, const odometer_parameters *p) {
  sum = hash_word(sum, (uint64_t)p->rule);
  return HASH_NUMBERS(sum, p->half_track, p->wheel_radius, p->sigma_step, p->factor_left, p->factor_right,
                      p->sigma_share, p->edges_per_turn, p->slips_per_s, p->slip_share);
}

static uint64_t hash_sensor(uint64_t sum, const vehicle_sensor *s) {
  sum = HASH_NUMBERS(hash_word(hash_word(sum, s->device), s->first), s->period);
  switch (s->kind) {
    case SENSOR_INFRARED_PROXIMITY: {
      const infrared_proximity *p = &s->as.infrared_proximity;
      sum = hash_word(hash_beam(sum, &p->beam), p->reflectance != 0);
      sum = hash_numbers(sum, &p->c1, 1);
      return HASH_NUMBERS(sum, p->range, p->c2, p->sigma);
    }
    case SENSOR_SHARP_INFRARED: {
      const sharp_infrared *p = &s->as.sharp_infrared;
      return HASH_NUMBERS(hash_beam(sum, &p->beam), p->reach, p->sigma, p->gain, p->period, p->late);
    }
    case SENSOR_SONAR: {
      const sonar *p = &s->as.sonar;
      sum = hash_word(hash_beam(sum, &p->beam), p->absorption != 0);
      return HASH_NUMBERS(sum, p->range_minimum, p->range_maximum, p->sigma, p->miss, p->grazing_cosine,
                          p->temperature);
    }
    case SENSOR_LASER:
      return hash_laser(sum, &s->as.laser);
    case SENSOR_COMPASS: {
      const compass_parameters *p = &s->as.compass;
      return HASH_NUMBERS(sum, p->sigma, p->bias, p->iron_x, p->iron_y, p->current_x, p->current_y);
    }
    case SENSOR_ACCELEROMETER: {
      const accelerometer_parameters *p = &s->as.accelerometer;
      return HASH_NUMBERS(sum, p->mass, p->stiffness, p->damping, p->range, p->sigma, p->bias);
    }
    case SENSOR_PHOTOTRANSISTOR: {
      const phototransistor *p = &s->as.phototransistor;
      return HASH_NUMBERS(hash_beam(sum, &p->mount), p->near_squared, p->ambient, p->sigma, p->gain);
    }
    case SENSOR_ODOMETER:
      return hash_odometer(sum, &s->as.odometer);
    case SENSOR_TABLE: {
      const table_sensor *t = &s->as.table;
      sum = HASH_NUMBERS(hash_beam(sum, &t->beam), t->range, t->none);
      return hash_word(sum, table_noise_fingerprint(t->table));
    }
    case SENSOR_WHISKER: {
      const whisker_segment *w = &s->as.whisker;
      return HASH_NUMBERS(sum, w->x0, w->y0, w->x1, w->y1);
    }
    default: {
      const battery_gauge *g = &s->as.battery;
      return HASH_NUMBERS(sum, g->empty, g->full, g->sigma);
    }
  }
}

uint64_t vehicle_model_fingerprint(const vehicle_model *self) {
  uint64_t sum = HASH_NUMBERS(hash_body(0, &self->body), self->dt);
  sum = hash_word(hash_drive(sum, self), (uint64_t)(self->noise != 0) | (uint64_t)(self->ends_at_collision != 0) << 1);
  if (self->has_battery)
    sum = HASH_NUMBERS(sum, self->energy.idle_per_s, self->energy.signal_per_s, self->energy.charger_per_s);
  sum = hash_word(sum, self->sensors_count);
  for (size_t i = 0; i < self->sensors_count; i++) sum = hash_sensor(sum, &self->sensors[i]);
  return sum;
}
