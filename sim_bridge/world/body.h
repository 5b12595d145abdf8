/* body.h: a differential-drive body: two driven wheels, a supporting point without friction, a circular outline.
 *
 * Motion follows (2.25)-(2.32) with the full A and B, by semi-implicit Euler steps (3.16)-(3.22): speeds, then heading,
 * then position. The wheels roll without slip along the heading; across it they hold by friction, which a wall can
 * overcome: `lateral` is the speed of that slip. A body that touches an edge loses the velocity into it and slides along it;
 * it gains no energy, sinks into nothing and passes through nothing.
 */
#ifndef WORLD_BODY_H
#define WORLD_BODY_H

#include <stdint.h>

#include "arena.h"

/* python: begin */
typedef struct {
  double mass;            /* M, kg, without wheels */
  double inertia;         /* I, kg m^2, about the vertical axis through the axle's middle, without wheels */
  double radius;          /* of the collision circle, m */
  double half_track;      /* R, m */
  double wheel_radius;    /* r, m */
  double wheel_mass;      /* m, kg */
  double wheel_inertia;   /* I_w, kg m^2, about the axle */
  double linear_damping;  /* alpha, N s/m */
  double angular_damping; /* beta, N m s */
  double lateral_grip;    /* friction coefficient of the wheels across the heading */
} body_parameters;

typedef struct {
  double x, y, heading; /* m, m, rad in (-pi, pi] */
  double speed;         /* V along the heading, m/s */
  double turn_rate;     /* rad/s, counter-clockwise */
  double lateral;       /* m/s, to the left */
  double wheel_left;    /* wheel angles, rad, forward positive */
  double wheel_right;
  double cosine, sine;     /* of the heading */
  double distance;         /* m travelled */
  int touching;            /* 1: in contact with an edge after the last step */
  double touch_x, touch_y; /* where */
} body_state;

/* A of (2.26) and B of (2.30). */
double body_a(const body_parameters *p);
double body_b(const body_parameters *p);
/* python: end */

#define BODY_NEAR_CAPACITY 24u
#define BODY_SKIN 1e-5 /* m; nearer than this counts as touching */

/* Edges that the body or what it carries could reach before it has moved by `slack` from (x, y). */
typedef struct {
  double x, y, slack;
  uint32_t version;
  uint32_t count; /* more than BODY_NEAR_CAPACITY: all edges */
  uint32_t edges[BODY_NEAR_CAPACITY];
} body_surroundings;

typedef struct {
  body_parameters parameters;
  double reach;        /* of the body and of what touches on it, m from the axle's middle */
  double force_gain;   /* A / M */
  double drag;         /* alpha / M */
  double torque_gain;  /* B / I */
  double turn_drag;    /* beta / I */
  double forward_mass; /* what a force along the heading meets, wheels included */
  double sideways_mass;
  body_state state;
  body_surroundings near;
} body;

/* A body at rest at a pose. `reach` is how far anything on it that touches gets from the axle's middle, in m. */
void body_init(body *self, const body_parameters *parameters, double reach);

/* Puts the body at a pose, at rest; wheel angles and distance stay. */
void body_place(body *self, double x, double y, double heading);

/* One step of `dt` seconds under the wheel torques, N m. */
void body_advance(body *self, const arena *where, double torque_left, double torque_right, double dt);

static inline double body_left_speed(const body *self) {
  return self->state.speed - self->parameters.half_track * self->state.turn_rate; /* (2.18), (2.19) */
}
static inline double body_right_speed(const body *self) {
  return self->state.speed + self->parameters.half_track * self->state.turn_rate;
}

/* 1 if the segment from (x0, y0) to (x1, y1), in the body's frame and within its reach, meets an edge. */
int body_segment_touches(body *self, const arena *where, double x0, double y0, double x1, double y1);

/* 1 if nothing is within the body's reach, without looking at an edge. */
int body_is_clear(body *self, const arena *where);

#endif
