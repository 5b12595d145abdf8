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

static uint64_t hash_sensor(uint64_t sum, const vehicle_sensor *s) {
  return s->kind->hash(HASH_NUMBERS(hash_word(hash_word(sum, s->device), s->first), s->period), s->made);
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
