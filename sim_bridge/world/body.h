/* body.h: a differential-drive body: two driven wheels, a supporting point without friction, a circle or polygon around.
 *
 * Motion follows (2.25)-(2.32) with the full A and B, by semi-implicit Euler steps (3.16)-(3.22): speeds, then heading,
 * then position. The wheels roll without slip as long as the tyres hold; beyond that they spin or slide (ground.h), and
 * their speed is another state. What a body meets it slides along; contact takes the velocity into it (restitution
 * 0), turns a body met off its centre, and gives no energy, lets nothing sink in and nothing through (contact.h).
 */
#ifndef WORLD_BODY_H
#define WORLD_BODY_H

#include <math.h>
#include <stdint.h>

#include "geometry/arena.h"
#include "geometry/scene.h"
#include "outline.h"

/* python: begin */
enum { BODY_HEADING_LIMIT = 100000 }; /* rad, that a body may be placed at: beyond it an angle loses its precision */

typedef struct {
  double mass;                 /* M, kg, without wheels */
  double inertia;              /* I, kg m^2, about the vertical axis through the axle's middle, without wheels */
  double radius;               /* of the collision circle, m; with an outline not used */
  const body_outline *outline; /* collision polygon, NULL: the circle */
  double half_track;           /* R, m */
  double axis_half_track;      /* by which a turn reaches the motors' axes, m; 0: R. ARSim takes R / 2 */
  double wheel_radius;         /* r, m */
  double wheel_mass;           /* m, kg */
  double wheel_inertia;        /* I_w, kg m^2, about the axle */
  double spin_inertia;         /* of a slipping wheel with the rotor behind its gear; 0: I_w, at least M r^2 / 10 */
  double linear_damping;       /* alpha, N s/m */
  double angular_damping;      /* beta, N m s */
  double grip;                 /* friction coefficient of the tyres where no patch says another */
  int slip;                    /* 0: wheels always roll without slip; grip holds only across the heading */
  double height;               /* of its top above the floor, m; 0: higher than any sensor */
} body_parameters;

typedef struct {
  double x, y, heading; /* m, m, rad in (-pi, pi] */
  double speed;         /* V along the heading, m/s */
  double turn_rate;     /* rad/s, counter-clockwise */
  double lateral;       /* m/s, to the left */
  double rim_left;      /* speeds of the wheels' rims, m/s forward: what motors and encoders see */
  double rim_right;
  double wheel_left; /* wheel angles, rad, forward positive */
  double wheel_right;
  double cosine, sine;     /* of the heading */
  double distance;         /* m travelled */
  double touch_x, touch_y; /* where it touches */
  int touching;            /* 1: in contact with something after the last step */
  int slipping;            /* 1: the rims' speeds are not those of the ground, or the body drifts sideways */
} body_state;

enum { BODY_MAXIMUM = 64 }; /* robots in one world */

/* A of (2.26) and B of (2.30). */
double body_a(const body_parameters *p);
double body_b(const body_parameters *p);

/* Half track by which a turn reaches the motors' axes, m. */
double body_axis_half_track(const body_parameters *p);
/* python: end */

#define BODY_EDGES_CAPACITY 24u
#define BODY_DISCS_CAPACITY 8u
#define BODY_SKIN 1e-5       /* m; nearer than this counts as touching */
#define BODY_LOOK_AHEAD 0.05 /* m: how far the list of near things stays good */
#define BODY_GRAVITY 9.81

/* What of the arena the body or what it carries could reach before it has moved by `slack` from (x, y). */
typedef struct {
  double x, y, slack;
  uint32_t version;
  uint16_t edge_count; /* more than the capacity: all edges */
  uint16_t disc_count;
  uint32_t edges[BODY_EDGES_CAPACITY];
  uint32_t discs[BODY_DISCS_CAPACITY];
} body_surroundings;

/* What is wrong with it in the step under way. Wheels left, right. */
typedef struct {
  int any;        /* 0: nothing, whatever the others say */
  int lifted;     /* held off the floor: the pose stays, wheels turn freely */
  int blocked[2]; /* the wheel cannot turn */
  double grip[2]; /* of the tyre, at most */
} body_faults;

typedef struct {
  body_parameters parameters;
  uint32_t id;          /* of the mover that it is; different for all robots of a world */
  double reach;         /* of the body and of what touches on it, m from the axle's middle */
  double body_reach;    /* of the body alone */
  double force_gain;    /* A / M */
  double drag;          /* alpha / M */
  double torque_gain;   /* B / I */
  double turn_drag;     /* beta / I */
  double per_radius;    /* 1 / r */
  double axis_offset;   /* R - axis_half_track, m: of a turn, what the motors' axes do not see */
  double spin;          /* I_w / r^2: mass of a wheel's turning at the rim */
  double slip_spin;     /* the same of a slipping wheel */
  double mass, inertia; /* of body and wheels without the wheels' turning: what a force on a slipping body meets */
  double half_load;     /* on a wheel, N */
  body_state state;
  body_faults faults;
  body_surroundings near;
} body;

/* How far the body gets from the axle's middle, in m. */
static inline double body_reach_of(const body_parameters *p) {
  return p->outline != NULL ? p->outline->reach : p->radius;
}

/* A body at rest at a pose. `reach` is how far anything on it that touches gets from the axle's middle, in m. */
void body_init(body *self, const body_parameters *parameters, double reach);

/* Puts the body at a pose, at rest; wheel angles and distance stay. */
/* What touches on the body reaches as far as this point of its frame. */
void body_widen_reach(body *self, double x, double y);

void body_place(body *self, double x, double y, double heading);

/* How others see it. Reflectances are 1. */
void body_as_mover(const body *self, mover *out);

/* Torque per rad/s that stops a wheel within `dt`: the least inertia felt at a wheel / dt. For motor_dc_torque. */
double body_wheel_hold(const body *self, double dt);

/* Speed of the ground under the wheels. */
static inline double body_left_speed(const body *self) {
  return self->state.speed - self->parameters.half_track * self->state.turn_rate; /* (2.18), (2.19) */
}
static inline double body_right_speed(const body *self) {
  return self->state.speed + self->parameters.half_track * self->state.turn_rate;
}

/* Speeds of the rims as the motors' axes see them: those of the wheels, unless the body has ARSim's half of R. */
static inline double body_axis_left(const body *self) {
  return self->state.rim_left + self->axis_offset * self->state.turn_rate;
}
static inline double body_axis_right(const body *self) {
  return self->state.rim_right - self->axis_offset * self->state.turn_rate;
}

/* How far its middle goes within `dt` by the speeds that it has, m. */
static inline double body_way(const body *self, double dt) {
  const body_state *s = &self->state;
  if (s->lateral == 0.0) return fabs(s->speed) * dt;
  return sqrt(s->speed * s->speed + s->lateral * s->lateral) * dt;
}

/* The farthest that a point of its core (outline.h) goes while the middle goes `way` and the body turns by `angle`. */
static inline double body_core_way(const body *self, double way, double angle) {
  return self->parameters.outline != NULL ? way + fabs(angle) * self->body_reach : way;
}

/* 1 if the segment from (x0, y0) to (x1, y1), in the body's frame and within its reach, meets something that is at least
 * `height` high: an edge or disc of the arena, a mover with another id. */
int body_segment_touches(body *self, const scene *around, double x0, double y0, double x1, double y1, double height);

/* 1 if the lists of near things are good while the body is within `share` of their slack. */
static inline int body_knows(const body *self, const arena *where, double share) {
  const body_surroundings *near = &self->near;
  const double dx = self->state.x - near->x;
  const double dy = self->state.y - near->y;
  const double good = share * near->slack;
  return good > 0.0 && dx * dx + dy * dy < good * good && near->version == arena_version(where);
}

/* Renews the lists of near things when the body has moved by more than `share` of what they are good for. */
void body_look_around(body *self, const arena *where, double share);

/* 1 if nothing of the arena is within the body's reach, without looking at it. */
static inline int body_is_clear(body *self, const arena *where) {
  if (!body_knows(self, where, 1.0)) body_look_around(self, where, 1.0);
  return self->near.edge_count == 0 && self->near.disc_count == 0;
}

/* What is on neither list, after looking around with a share of 1/2, is at least so far from the body's core (outline.h). */
static inline double body_looks_far(const body *self) {
  return self->reach + 0.5 * BODY_LOOK_AHEAD - (self->parameters.outline != NULL ? self->body_reach : 0.0);
}

/* Numbers of the near edges or discs; NULL: all of the arena's are to be looked at. */
const uint32_t *body_near_edges(const body *self, const arena *where, size_t *count);
const uint32_t *body_near_discs(const body *self, const arena *where, size_t *count);

#endif
