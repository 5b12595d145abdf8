/* body_step.c: see body_step.h. */
#include "body_step.h"

#include <math.h>
#include <string.h>

#include "contact.h"
#include "geometry/numbers.h"
#include "ground.h"

#define SPEED_LIMIT 100.0 /* m/s: a drive that diverges stays finite */
#define TURN_LIMIT 1000.0 /* rad/s */
#define SLIP_ROUNDS 40
#define SLIP_SETTLED 1e-12 /* m/s */

/* ---- speeds ------------------------------------------------------------------------------------------------------- */

/* Tyres that slip, and what the body leans on meanwhile, answer each other until they agree. */
static void slide(body *self, const scene *around, const double limits[2], const double torque[2], double dt) {
  ground floor;
  contact_holds at;
  contact_lean(self, around, dt, &at);
  ground_begin(&floor, self, limits, torque[0], torque[1], dt);
  for (int round = 0; round < SLIP_ROUNDS; round++) {
    double change = ground_round(&floor, self);
    if (at.count > 0) change += contact_stop(self, &at);
    if (change < SLIP_SETTLED) break;
  }
  ground_end(&floor, self, dt);
}

/* Rolling for certain (slip switched off), held across the heading by friction that something may have overcome. */
static void hold_across(body *self, const scene *around, const double limits[2], double dt) {
  body_state *s = &self->state;
  contact_holds at;
  contact_lean(self, around, dt, &at);
  const double most = (limits[0] + limits[1]) * dt / self->mass;
  double held = 0.0;
  for (int round = 0; round < SLIP_ROUNDS; round++) {
    const double wanted = number_limited(held - s->lateral, most);
    double change = fabs(wanted - held);
    s->lateral += wanted - held;
    held = wanted;
    if (at.count > 0) change += contact_stop(self, &at);
    if (change < SLIP_SETTLED) return;
  }
}

/* Off the floor the wheels turn by their torques alone. */
static void spin(body *self, const double torque[2], double dt) {
  body_state *s = &self->state;
  const double gain = dt * self->per_radius / self->slip_spin;
  s->rim_left = self->faults.blocked[0] ? 0.0 : number_limited(s->rim_left + gain * torque[0], 10.0 * SPEED_LIMIT);
  s->rim_right = self->faults.blocked[1] ? 0.0 : number_limited(s->rim_right + gain * torque[1], 10.0 * SPEED_LIMIT);
  s->speed = s->turn_rate = s->lateral = 0.0;
  s->slipping = 1;
}

/* New speeds by the torques. */
static void drive(body *self, const scene *around, const double torque[2], double dt) {
  body_state *s = &self->state;
  const body_parameters *p = &self->parameters;
  double limits[2] = {0.0, 0.0};
  if (!s->slipping && !self->faults.any &&
      !(p->slip && s->touching)) { /* in touch, tyres and contact are solved together */
    /* (2.31), (2.32), (3.16), (3.17) */
    const double force = self->force_gain * (torque[0] + torque[1]) - self->drag * s->speed;
    const double moment = self->torque_gain * (torque[1] - torque[0]) - self->turn_drag * s->turn_rate;
    const double speed = number_limited(s->speed + dt * force, SPEED_LIMIT);
    const double turn_rate = number_limited(s->turn_rate + dt * moment, TURN_LIMIT);
    if (p->slip ? s->lateral == 0.0 : s->lateral != 0.0) ground_limits(self, around->arena, limits);
    if (!p->slip || (s->lateral == 0.0 && ground_holds(self, limits, torque[0], torque[1], speed, turn_rate, dt))) {
      s->speed = speed;
      s->turn_rate = turn_rate;
      if (s->lateral != 0.0) hold_across(self, around, limits, dt);
      return;
    }
  }
  if (self->faults.any && self->faults.lifted) {
    spin(self, torque, dt);
    return;
  }
  ground_limits(self, around->arena, limits);
  for (int i = 0; self->faults.any && i < 2; i++) limits[i] = fmin(limits[i], self->half_load * self->faults.grip[i]);
  slide(self, around, limits, torque, dt);
  s->speed = number_limited(s->speed, SPEED_LIMIT);
  s->lateral = number_limited(s->lateral, SPEED_LIMIT);
  s->turn_rate = number_limited(s->turn_rate, TURN_LIMIT);
  s->rim_left = number_limited(s->rim_left, 10.0 * SPEED_LIMIT);
  s->rim_right = number_limited(s->rim_right, 10.0 * SPEED_LIMIT);
}

/* ---- steps -------------------------------------------------------------------------------------------------------- */

/* While motors drive, a mover that waited presses on nobody: what it pinches would have to have two speeds. */
static void rest_movers(const scene *around, double dt) {
  for (size_t i = 0; i < around->movers_count; i++) around->movers[i].stops = around->movers[i].waits ? 0.0 : dt;
}

/* All movers go, until contacts stop one. */
static void start_movers(const scene *around, double dt) {
  for (size_t i = 0; i < around->movers_count; i++) around->movers[i].stops = dt;
}

static void count_waits(const scene *around, double dt) {
  for (size_t i = 0; i < around->movers_count; i++) {
    mover *m = &around->movers[i];
    m->waits = m->stops < dt;
    m->waited += dt - m->stops;
  }
}

/* Distance of a mover from the circle that holds the body. */
static double mover_gap(const body *self, const mover *m) {
  const double dx = m->x - self->state.x;
  const double dy = m->y - self->state.y;
  return sqrt(dx * dx + dy * dy) - m->radius - self->body_reach;
}

/* 1 if the two could meet within the step, in which the body's middle moves by `way`. */
static int mover_is_near(const body *self, const mover *m, double way, double dt) {
  return mover_gap(self, m) < way + contact_mover_speed(m) * dt + BODY_LOOK_AHEAD;
}

/* 1 if contact would cut the step into parts even where nothing is near, because the body or a mover goes so far in it. */
static int is_long(const body *self, const scene *around, double way, double dt) {
  double least = body_looks_far(self);
  double fastest = 0.0;
  for (size_t i = 0; i < around->movers_count; i++) {
    const mover *m = &around->movers[i];
    least = fmin(least, mover_gap(self, m));
    fastest = fmax(fastest, contact_mover_speed(m));
  }
  return body_core_way(self, way, self->state.turn_rate * dt) + fastest * dt > 0.5 * least;
}

/* 1 if nothing can come within the body's reach during the step, in which its middle moves by `way`: it stays within the
 * clear circle around where it looked, and no mover is near. Where it looked last must not show: what goes through
 * contact without touching anything comes out the same. */
static int stays_clear(body *self, const scene *around, double way, double dt) {
  const body_state *s = &self->state;
  const body_surroundings *near = &self->near;
  if (is_long(self, around, way, dt)) return 0;
  if (!body_is_clear(self, around->arena)) return 0;
  const double dx = s->x - near->x;
  const double dy = s->y - near->y;
  const double room = near->slack - way;
  if (!(room > 0.0) || dx * dx + dy * dy >= room * room) {
    self->near.slack = -1.0; /* look from here */
    if (!body_is_clear(self, around->arena) || way >= near->slack) return 0;
  }
  for (size_t i = 0; i < around->movers_count; i++) {
    if (mover_is_near(self, &around->movers[i], way, dt)) return 0;
  }
  return 1;
}

/* Heading, (3.18), then position, (3.19)-(3.22), where nothing is in the way. */
static void move_freely(body *self, double way, double dt) {
  body_state *s = &self->state;
  contact_turn(self, s->turn_rate * dt);
  s->x += (s->speed * s->cosine - s->lateral * s->sine) * dt;
  s->y += (s->speed * s->sine + s->lateral * s->cosine) * dt;
  s->distance += way;
  s->touching = 0;
}

static int is_finite(double left, double right) { return fabs(left) + fabs(right) < 1e300; }

static void turn_wheels(body *self, double dt) {
  body_state *s = &self->state;
  if (!s->slipping) { /* rolling without slip, (2.16), (2.17) */
    s->rim_left = body_left_speed(self);
    s->rim_right = body_right_speed(self);
  }
  const double angle = self->per_radius * dt;
  s->wheel_left += s->rim_left * angle;
  s->wheel_right += s->rim_right * angle;
}

/* Makes the groups of places i and k one. */
static void join(size_t group[], size_t count, size_t i, size_t k) {
  const size_t less = group[i] < group[k] ? group[i] : group[k];
  const size_t more = group[i] < group[k] ? group[k] : group[i];
  for (size_t n = 0; n < count && less != more; n++) {
    if (group[n] == more) group[n] = less;
  }
}

/* Numbers the groups of robots that could meet within the step, or the same mover: it waits for all or for none. Each gets
 * the least place of its group. */
static void find_groups(body *const bodies[], size_t count, const scene *around, double dt, size_t group[]) {
  for (size_t i = 0; i < count; i++) group[i] = i;
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < i; k++) {
      const body *a = bodies[i];
      const body *b = bodies[k];
      const double reach = a->body_reach + b->body_reach + body_way(a, dt) + body_way(b, dt) + BODY_LOOK_AHEAD;
      const double dx = a->state.x - b->state.x;
      const double dy = a->state.y - b->state.y;
      if (dx * dx + dy * dy < reach * reach) join(group, count, i, k);
    }
  }
  for (size_t m = 0; count > 1 && m < around->movers_count; m++) {
    size_t first = count;
    for (size_t i = 0; i < count; i++) {
      if (!mover_is_near(bodies[i], &around->movers[m], body_way(bodies[i], dt), dt)) continue;
      if (first == count) first = i;
      join(group, count, first, i);
    }
  }
}

/* Places of the bodies in the order of their ids. */
static void sort(body *const bodies[], size_t count, size_t order[]) {
  for (size_t i = 0; i < count; i++) {
    size_t at = i;
    while (at > 0 && bodies[order[at - 1]]->id > bodies[i]->id) {
      order[at] = order[at - 1];
      at--;
    }
    order[at] = i;
  }
}

void body_step(body *const bodies[], size_t count, const scene *around, const double torques[][2], double dt) {
  for (size_t i = 0; i < count; i++) {
    if (!is_finite(torques[i][0], torques[i][1])) return;
  }
  size_t order[BODY_MAXIMUM];
  body *sorted[BODY_MAXIMUM];
  body *together[BODY_MAXIMUM];
  size_t group[BODY_MAXIMUM];
  sort(bodies, count, order);
  rest_movers(around, dt);
  for (size_t i = 0; i < count; i++) {
    sorted[i] = bodies[order[i]];
    drive(sorted[i], around, torques[order[i]], dt);
  }
  start_movers(around, dt);
  find_groups(sorted, count, around, dt, group);
  for (size_t i = 0; i < count; i++) {
    if (group[i] != i) continue;
    size_t members = 0;
    for (size_t k = i; k < count; k++) {
      if (group[k] == i) together[members++] = sorted[k];
    }
    const double way = body_way(sorted[i], dt);
    if (members == 1 && stays_clear(sorted[i], around, way, dt)) {
      move_freely(sorted[i], way, dt);
    } else {
      contact_move(together, members, around, dt);
    }
  }
  count_waits(around, dt);
  for (size_t i = 0; i < count; i++) turn_wheels(sorted[i], dt);
}
