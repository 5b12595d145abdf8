/* body.c: see body.h. */
#include "body.h"

#include <math.h>
#include <string.h>

#include "numbers.h"

#define GRAVITY 9.81
#define LOOK_AHEAD 0.05      /* m: how far the list of near edges stays good */
#define CLEARANCE_LIMIT 0.75 /* m */
#define CONTACT_ROUNDS 12
#define SPEED_LIMIT 100.0 /* m/s: a drive that diverges stays finite */
#define TURN_LIMIT 1000.0 /* rad/s */

double body_a(const body_parameters *p) { /* (2.26) */
  const double r = p->wheel_radius;
  return 1.0 / (r * (1.0 + 2.0 * (p->wheel_inertia / (p->mass * r * r) + p->wheel_mass / p->mass)));
}

double body_b(const body_parameters *p) { /* (2.30) */
  const double r = p->wheel_radius;
  const double half = p->half_track;
  return 1.0 / (r / half + 2.0 * (p->wheel_inertia * half / (p->inertia * r) + p->wheel_mass * half * r / p->inertia));
}

void body_init(body *self, const body_parameters *parameters, double reach) {
  memset(self, 0, sizeof *self);
  const double a = body_a(parameters);
  self->parameters = *parameters;
  self->reach = reach > parameters->radius + BODY_SKIN ? reach : parameters->radius + BODY_SKIN;
  self->force_gain = a / parameters->mass;
  self->drag = parameters->linear_damping / parameters->mass;
  self->torque_gain = body_b(parameters) / parameters->inertia;
  self->turn_drag = parameters->angular_damping / parameters->inertia;
  self->forward_mass = parameters->mass / (a * parameters->wheel_radius);
  self->sideways_mass = parameters->mass + 2.0 * parameters->wheel_mass;
  body_place(self, 0.0, 0.0, 0.0);
}

void body_place(body *self, double x, double y, double heading) {
  body_state *s = &self->state;
  s->x = x;
  s->y = y;
  s->heading = number_wrap(heading);
  number_sincos(s->heading, &s->sine, &s->cosine);
  s->speed = s->turn_rate = s->lateral = 0.0;
  s->touching = 0;
  self->near.slack = -1.0;
}

/* Renews the list of near edges when the body has moved out of what it covers. */
static void look_around(body *self, const arena *where) {
  body_surroundings *near = &self->near;
  const double dx = self->state.x - near->x;
  const double dy = self->state.y - near->y;
  if (near->version == arena_version(where) && near->slack > 0.0 && dx * dx + dy * dy < near->slack * near->slack)
    return;
  near->x = self->state.x;
  near->y = self->state.y;
  near->version = arena_version(where);
  const double clearance = arena_clearance(where, near->x, near->y, CLEARANCE_LIMIT);
  if (clearance > self->reach + LOOK_AHEAD) {
    near->count = 0;
    near->slack = clearance - self->reach;
    return;
  }
  near->slack = LOOK_AHEAD;
  near->count =
      (uint32_t)arena_edges_near(where, near->x, near->y, self->reach + LOOK_AHEAD, near->edges, BODY_NEAR_CAPACITY);
}

int body_is_clear(body *self, const arena *where) {
  look_around(self, where);
  return self->near.count == 0;
}

static size_t near_count(const body *self, const arena *where) {
  return self->near.count > BODY_NEAR_CAPACITY ? arena_edge_count(where) : self->near.count;
}

static const arena_edge *near_edge(const body *self, const arena *where, size_t i) {
  return &arena_edges(where)[self->near.count > BODY_NEAR_CAPACITY ? i : self->near.edges[i]];
}

int body_segment_touches(body *self, const arena *where, double x0, double y0, double x1, double y1) {
  look_around(self, where);
  if (self->near.count == 0) return 0;
  const body_state *s = &self->state;
  const double ax = s->x + x0 * s->cosine - y0 * s->sine;
  const double ay = s->y + x0 * s->sine + y0 * s->cosine;
  const double bx = s->x + x1 * s->cosine - y1 * s->sine;
  const double by = s->y + x1 * s->sine + y1 * s->cosine;
  const size_t count = near_count(self, where);
  for (size_t i = 0; i < count; i++) {
    if (arena_edge_meets_segment(near_edge(self, where, i), ax, ay, bx, by)) return 1;
  }
  return 0;
}

/* The point of an edge nearest to the body's centre. Returns the squared distance, 1e300 if no edge is near. */
static double nearest_point(const body *self, const arena *where, double *qx, double *qy) {
  double best = 1e300;
  double px, py;
  const size_t count = near_count(self, where);
  for (size_t i = 0; i < count; i++) {
    const double d = arena_edge_distance_squared(near_edge(self, where, i), self->state.x, self->state.y, &px, &py);
    if (d < best) {
      best = d;
      *qx = px;
      *qy = py;
    }
  }
  return best;
}

/* Takes away the velocity into a contact with normal (nx, ny), which points from the edge to the body: an impulse through
 * the body's centre, without restitution, on the mass that the body has along and across its heading. */
static void stop_into(body *self, double nx, double ny) {
  body_state *s = &self->state;
  const double along = nx * s->cosine + ny * s->sine;
  const double across = ny * s->cosine - nx * s->sine;
  const double into = s->speed * along + s->lateral * across;
  if (into >= 0.0) return;
  const double impulse = -into / (along * along / self->forward_mass + across * across / self->sideways_mass);
  s->speed += impulse * along / self->forward_mass;
  s->lateral += impulse * across / self->sideways_mass;
}

/* Moves by (dx, dy), no farther than a quarter of the radius, and out of whatever was met. */
static void move(body *self, const arena *where, double dx, double dy) {
  body_state *s = &self->state;
  const double from_x = s->x;
  const double from_y = s->y;
  const double radius = self->parameters.radius;
  s->x += dx;
  s->y += dy;
  look_around(self, where);
  if (self->near.count == 0) return;
  for (int round = 0; round < CONTACT_ROUNDS; round++) {
    double qx = 0.0;
    double qy = 0.0;
    const double squared = nearest_point(self, where, &qx, &qy);
    if (squared >= (radius + BODY_SKIN) * (radius + BODY_SKIN)) return;
    s->touching = 1;
    s->touch_x = qx;
    s->touch_y = qy;
    const double distance = sqrt(squared);
    if (distance <= 0.0) break;
    const double nx = (s->x - qx) / distance;
    const double ny = (s->y - qy) / distance;
    if (distance >= radius - 1e-12) return;
    stop_into(self, nx, ny);
    s->x = qx + radius * nx;
    s->y = qy + radius * ny;
  }
  /* A wedge narrower than the body: it stays where it was. */
  s->x = from_x;
  s->y = from_y;
  s->speed = s->lateral = 0.0;
}

static double limited(double value, double limit) { return value > limit ? limit : (value < -limit ? -limit : value); }

void body_advance(body *self, const arena *where, double torque_left, double torque_right, double dt) {
  body_state *s = &self->state;
  const body_parameters *p = &self->parameters;
  s->speed += dt * (self->force_gain * (torque_left + torque_right) - self->drag * s->speed); /* (2.31), (3.16) */
  s->turn_rate += dt * (self->torque_gain * (torque_right - torque_left) - self->turn_drag * s->turn_rate); /* (2.32) */
  s->speed = limited(s->speed, SPEED_LIMIT);
  s->turn_rate = limited(s->turn_rate, TURN_LIMIT);
  if (s->lateral != 0.0) {
    const double grip = p->lateral_grip * GRAVITY * dt;
    s->lateral = s->lateral > grip ? s->lateral - grip : (s->lateral < -grip ? s->lateral + grip : 0.0);
  }
  s->heading = number_wrap(s->heading + s->turn_rate * dt);
  number_sincos(s->heading, &s->sine, &s->cosine);
  const double from_x = s->x;
  const double from_y = s->y;
  const double dx = (s->speed * s->cosine - s->lateral * s->sine) * dt;
  const double dy = (s->speed * s->sine + s->lateral * s->cosine) * dt;
  const double length = sqrt(dx * dx + dy * dy);
  const double longest = 0.25 * p->radius;
  s->touching = 0;
  if (length <= longest) {
    move(self, where, dx, dy);
  } else {
    const long long parts = 1 + number_floor(length / longest);
    double planned_speed = s->speed;
    double planned_lateral = s->lateral;
    double px = dx / (double)parts;
    double py = dy / (double)parts;
    for (long long i = 0; i < parts; i++) {
      move(self, where, px, py);
      if (s->speed != planned_speed || s->lateral != planned_lateral) { /* a contact changed the way */
        planned_speed = s->speed;
        planned_lateral = s->lateral;
        px = (s->speed * s->cosine - s->lateral * s->sine) * dt / (double)parts;
        py = (s->speed * s->sine + s->lateral * s->cosine) * dt / (double)parts;
      }
    }
  }
  const double moved_x = s->x - from_x;
  const double moved_y = s->y - from_y;
  s->distance += sqrt(moved_x * moved_x + moved_y * moved_y);
  s->wheel_left += body_left_speed(self) / p->wheel_radius * dt; /* rolling without slip, (2.16), (2.17) */
  s->wheel_right += body_right_speed(self) / p->wheel_radius * dt;
}
