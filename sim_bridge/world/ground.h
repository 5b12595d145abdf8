/* ground.h: what the floor can do to two tyres: hold them, up to Coulomb friction along and across the heading together.
 *
 * Each wheel carries half the weight. While the force that rolling without slip needs lies within grip * load at both
 * wheels, (2.16) and (2.17) hold. Beyond that a wheel's rim has its own speed, I_w dw/dt = tau - F r (2.12), and the
 * floor pulls against the slip, F = -grip N s / |s| with s the velocity of the tyre's print over the floor. A step solves
 * both wheels together for the impulses that leave the least energy, which is that law with the slip at the step's
 * end: stable at any step, and it never adds energy. With `slip` off the wheels always roll, and only the speed across
 * the heading is held by friction. A wheel that is blocked is one whose rim stands still whatever the floor does to it.
 */
#ifndef WORLD_GROUND_H
#define WORLD_GROUND_H

#include "body.h"

typedef struct {
  double along[2], across[2]; /* impulses of the floor on the tyres so far, N s */
  double limit[2];
} ground;

/* Friction limits, N, of the wheels where they stand. */
static inline void ground_limits(const body *self, const arena *where, double limits[2]) {
  const body_state *s = &self->state;
  const double grip = self->parameters.grip;
  const double dx = -self->parameters.half_track * s->sine;
  const double dy = self->parameters.half_track * s->cosine;
  limits[0] = self->half_load * arena_grip(where, s->x + dx, s->y + dy, grip);
  limits[1] = self->half_load * arena_grip(where, s->x - dx, s->y - dy, grip);
}

/* 1 if the tyres hold while the body, that rolls, comes to these speeds within `dt` under these torques. */
static inline int ground_holds(const body *self, const double limits[2], double torque_left, double torque_right,
                               double speed, double turn_rate, double dt) {
  const body_state *s = &self->state;
  const double forward = self->spin * (speed - s->speed);
  const double turning = self->spin * self->parameters.half_track * (turn_rate - s->turn_rate);
  const double left = torque_left * self->per_radius * dt - (forward - turning); /* (2.12), (2.16): impulse of F_L */
  const double right = torque_right * self->per_radius * dt - (forward + turning);
  const double across = 0.5 * self->mass * speed * turn_rate * dt; /* centripetal, half a wheel */
  const double most_left = limits[0] * dt;
  const double most_right = limits[1] * dt;
  return left * left + across * across <= most_left * most_left &&
         right * right + across * across <= most_right * most_right;
}

/* Torques and drag of a step on a body whose tyres slip; from here on its rims have their own speeds. */
void ground_begin(ground *self, body *of, const double limits[2], double torque_left, double torque_right, double dt);

/* One round of the floor's answer. Returns by how much it changed a speed, m/s. */
double ground_round(ground *self, body *of);

/* The body rolls again if both tyres hold, and could hold it on its curve. */
void ground_end(const ground *self, body *of, double dt);

#endif
