/* stages.c: the stages of one step of one world, see vehicle.h. */
#include <math.h>

#include "geometry/numbers.h"
#include "sense.h"
#include "vehicle.h"

#define SERVO_PERIOD_S 0.020
#define CONTACT_GAP_S 0.1 /* touches nearer in time are one contact */

int vehicles_send(vehicles *self, size_t i, double left, double right) {
  if (!isfinite(left) || !isfinite(right)) return VEHICLE_BAD_NUMBER;
  self->worlds[i].state.signals[0] = number_limited(left, 1.0);
  self->worlds[i].state.signals[1] = number_limited(right, 1.0);
  return VEHICLE_OK;
}

/* Torque of a quasi-static DC motor by its signal and the speed of its wheel. */
static double dc_torque(const motor_dc_parameters *motor, double signal, double speed, double hold) {
  const double volts = signal * motor->voltage_maximum; /* V = s V_max: a signal that was sent is limited */
  return motor_dc_geared(motor, motor_dc_current(motor, volts, speed), speed, motor_dc_stopping(motor, hold));
}

/* Pulse of a motor signal: by the board's map, or by the notes'. */
static double pulse_of(const vehicle *w, int side) {
  const vehicle_model *m = w->all->model;
  if (m->has_board) return motion_pulse_of(&m->motion[side], w->state.signals[side]) / MOTION_COUNTS_PER_US;
  return servo_motor_pulse_of(&w->servo[side], w->state.signals[side]);
}

/* Torques of both wheels for the next step. */
static void torques(const vehicle_model *m, vehicle *w, double out[2]) {
  vehicle_state *s = &w->state;
  const double rims[2] = {body_axis_left(&w->body), body_axis_right(&w->body)};
  if (m->drive == DRIVE_DC) {
    for (int side = 0; side < 2; side++) {
      const motor_dc_parameters *motor = &m->dc[side];
      const double speed = rims[side] / m->body.wheel_radius;
      out[side] = m->full ? motor_dc_step(motor, &s->currents[side], motor_dc_voltage(motor, s->signals[side]), speed,
                                          w->hold, m->dt)
                          : dc_torque(motor, s->signals[side], speed, w->hold);
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
    const servo_motor_parameters *servo = &w->servo[side];
    if (pulse && !s->coasts) servo_motor_pulse(servo, &s->servos[side], pulse_of(w, side));
    out[side] = servo_motor_torque(servo, &s->servos[side], rims[side], 1.0);
  }
  if (pulse) s->next_pulse = s->step + (m->dt < SERVO_PERIOD_S ? (uint64_t)(SERVO_PERIOD_S / m->dt + 0.5) : 1u);
}

static size_t index_of(const vehicle *w) { return (size_t)(w - w->all->worlds); }

static void begin_step(void *owner, double out[2]) {
  vehicle *w = owner;
  vehicles_sense(w->all, index_of(w)); /* in a world of several nobody may have asked yet */
  if (w->state.flag != VEHICLE_RUNS) (void)vehicles_send(w->all, index_of(w), 0.0, 0.0);
  w->speed_before = w->body.state.speed;
  torques(w->all->model, w, out);
}

static void has_moved(void *owner) {
  vehicle *w = owner;
  w->state.acceleration = (w->body.state.speed - w->speed_before) / w->all->model->dt;
  w->state.step++;
}

static void end_step(void *owner) {
  vehicle *w = owner;
  (void)vehicles_check(w->all, index_of(w));
  vehicles_sense(w->all, index_of(w));
}

const world_robot_operations VEHICLE_OPERATIONS = {.torques = begin_step, .moved = has_moved, .sense = end_step};

void vehicles_move(vehicles *self, size_t i) { world_move(&self->worlds[i].own); }

void vehicles_update_arena(vehicles *self, size_t i) { world_update(&self->worlds[i].own); }

static void count_contact(vehicle_state *s, double dt) {
  if (s->contacts == 0 || s->step - s->touched > (uint64_t)(CONTACT_GAP_S / dt + 0.5)) s->contacts++;
  s->touched = s->step;
}

int vehicles_check(vehicles *self, size_t i) {
  const vehicle_model *m = self->model;
  vehicle_state *s = &self->worlds[i].state;
  const body_state *b = &self->worlds[i].body.state;
  if (b->touching) count_contact(s, m->dt);
  const int at_charger = m->has_battery && arena_is_at_charger(self->worlds[i].in->arena, b->x, b->y);
  if (m->has_battery) s->energy = energy_step(&m->energy, s->energy, s->signals[0], s->signals[1], at_charger, m->dt);
  if (m->ends_at_collision && b->touching) {
    s->flag = VEHICLE_COLLIDED;
  } else if (m->has_battery && s->energy <= 0.0) {
    s->flag = VEHICLE_EXHAUSTED;
  }
  return s->flag;
}
