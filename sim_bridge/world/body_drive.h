/* body_drive.h: the parts of a body's step, for a body by itself, several in one world (body.c) and a row (body_row.c). */
#ifndef WORLD_BODY_DRIVE_H
#define WORLD_BODY_DRIVE_H

#include "body.h"
#include "geometry/numbers.h"

#define BODY_SPEED_LIMIT 100.0 /* m/s: a drive that diverges stays finite */
#define BODY_TURN_LIMIT 1000.0 /* rad/s */

/* (2.31), (2.32), (3.16), (3.17) */
NUMBERS_INLINE void body_speed_up(const body *self, double torque_left, double torque_right, double dt, double *speed,
                                  double *turn_rate) {
  const double force = self->force_gain * (torque_left + torque_right) - self->drag * *speed;
  const double moment = self->torque_gain * (torque_right - torque_left) - self->turn_drag * *turn_rate;
  *speed = number_limited(*speed + dt * force, BODY_SPEED_LIMIT);
  *turn_rate = number_limited(*turn_rate + dt * moment, BODY_TURN_LIMIT);
}

/* (3.19)-(3.22) */
NUMBERS_INLINE void body_shift(double speed, double lateral, double cosine, double sine, double dt, double *x,
                               double *y) {
  *x += (speed * cosine - lateral * sine) * dt;
  *y += (speed * sine + lateral * cosine) * dt;
}

/* While motors drive, a mover that waited presses on nobody: what it pinches would have to have two speeds. */
static inline void body_rest_movers(const scene *around, double dt) {
  for (size_t i = 0; i < around->movers_count; i++) around->movers[i].stops = around->movers[i].waits ? 0.0 : dt;
}

/* All movers go, until contacts stop one. */
static inline void body_start_movers(const scene *around, double dt) {
  for (size_t i = 0; i < around->movers_count; i++) around->movers[i].stops = dt;
}

static inline void body_count_waits(const scene *around, double dt) {
  for (size_t i = 0; i < around->movers_count; i++) {
    mover *m = &around->movers[i];
    m->waits = m->stops < dt;
    m->waited += dt - m->stops;
  }
}

/* New speeds by the torques. */
void body_drive(body *self, const scene *around, const double torque[2], double dt);

/* 1 if nothing can come within the body's reach during the step, in which its middle moves by `way`. */
int body_stays_clear(body *self, const scene *around, double way, double dt);

/* Moves by `way`; `clear`: what body_stays_clear says. */
void body_move_alone(body *self, const scene *around, int clear, double way, double dt);

/* The wheels, which after a step without slip go as the ground does. */
void body_turn_wheels(body *self, double dt);

#endif
