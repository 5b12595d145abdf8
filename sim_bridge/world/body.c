/* body.c: see body.h. */
#include "body.h"

#include <math.h>
#include <string.h>

#include "geometry/numbers.h"

#define SPIN_SHARE 0.1 /* least spin inertia of a slipping wheel / M r^2 */

double body_a(const body_parameters *p) { /* (2.26) */
  const double r = p->wheel_radius;
  return 1.0 / (r * (1.0 + 2.0 * (p->wheel_inertia / (p->mass * r * r) + p->wheel_mass / p->mass)));
}

double body_b(const body_parameters *p) { /* (2.30) */
  const double r = p->wheel_radius;
  const double half = p->half_track;
  return 1.0 / (r / half + 2.0 * (p->wheel_inertia * half / (p->inertia * r) + p->wheel_mass * half * r / p->inertia));
}

double body_axis_half_track(const body_parameters *p) {
  return p->axis_half_track > 0.0 ? p->axis_half_track : p->half_track;
}

void body_init(body *self, const body_parameters *parameters, double reach) {
  const body_parameters *p = parameters;
  memset(self, 0, sizeof *self);
  self->parameters = *p;
  self->body_reach = body_reach_of(p);
  self->reach = reach > self->body_reach + BODY_SKIN ? reach : self->body_reach + BODY_SKIN;
  self->force_gain = body_a(p) / p->mass;
  self->drag = p->linear_damping / p->mass;
  self->torque_gain = body_b(p) / p->inertia;
  self->turn_drag = p->angular_damping / p->inertia;
  self->per_radius = 1.0 / p->wheel_radius;
  self->axis_offset = p->half_track - body_axis_half_track(p);
  self->spin = p->wheel_inertia * self->per_radius * self->per_radius;
  const double least = SPIN_SHARE * p->mass;
  self->slip_spin = p->spin_inertia > 0.0 ? p->spin_inertia * self->per_radius * self->per_radius
                                          : (self->spin > least ? self->spin : least);
  self->mass = p->mass + 2.0 * p->wheel_mass;
  self->inertia = p->inertia + 2.0 * p->wheel_mass * p->half_track * p->half_track;
  self->half_load = 0.5 * self->mass * BODY_GRAVITY;
  body_place(self, 0.0, 0.0, 0.0);
}

void body_place(body *self, double x, double y, double heading) {
  body_state *s = &self->state;
  s->x = x;
  s->y = y;
  s->heading = number_wrap(heading);
  number_sincos(s->heading, &s->sine, &s->cosine);
  s->speed = s->turn_rate = s->lateral = s->rim_left = s->rim_right = 0.0;
  s->touching = s->slipping = 0;
  self->near.slack = -1.0;
}

void body_as_mover(const body *self, mover *out) {
  const body_state *s = &self->state;
  const body_parameters *p = &self->parameters;
  *out = (mover){
      .x = s->x,
      .y = s->y,
      .cosine = s->cosine,
      .sine = s->sine,
      .vx = s->speed * s->cosine - s->lateral * s->sine,
      .vy = s->speed * s->sine + s->lateral * s->cosine,
      .turn_rate = s->turn_rate,
      .radius = self->body_reach,
      .outline = p->outline != NULL ? p->outline->xy : NULL,
      .corners = p->outline != NULL ? p->outline->corners : 0,
      .height = p->height > 0.0 ? p->height : 1e300,
      .infrared_reflectance = 1.0,
      .sound_reflectance = 1.0,
      .id = self->id,
  };
}

double body_wheel_hold(const body *self, double dt) {
  const body_parameters *p = &self->parameters;
  const double straight = 0.5 * self->mass + self->spin; /* at the rim, one of two wheels */
  const double turning = 0.5 * self->inertia / (p->half_track * p->half_track) + self->spin;
  return (straight < turning ? straight : turning) * p->wheel_radius * p->wheel_radius / dt;
}

void body_widen_reach(body *self, double x, double y) {
  const double distance = sqrt(x * x + y * y);
  if (distance > self->reach) self->reach = distance;
  self->near.slack = -1.0; /* look around again */
}
