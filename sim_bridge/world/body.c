/* body.c: see body.h. */
#include "body.h"

#include <math.h>
#include <string.h>

#include "contact.h"
#include "ground.h"
#include "numbers.h"

#define LOOK_AHEAD 0.05      /* m: how far the list of near things stays good */
#define CLEARANCE_LIMIT 0.75 /* m */
#define SPEED_LIMIT 100.0    /* m/s: a drive that diverges stays finite */
#define TURN_LIMIT 1000.0    /* rad/s */
#define SLIP_ROUNDS 40
#define SLIP_SETTLED 1e-12 /* m/s */
#define SPIN_SHARE 0.1     /* least spin inertia of a slipping wheel / M r^2 */

const char *body_parameters_wrong(const body_parameters *p) {
  const struct {
    const char *name;
    double value;
    int may_be_zero;
  } all[] = {
      {"mass", p->mass, 0},
      {"inertia", p->inertia, 0},
      {"radius", p->outline != NULL ? p->outline->reach : p->radius, 0},
      {"half_track", p->half_track, 0},
      {"wheel_radius", p->wheel_radius, 0},
      {"wheel_mass", p->wheel_mass, 1},
      {"wheel_inertia", p->wheel_inertia, 1},
      {"spin_inertia", p->spin_inertia, 1},
      {"linear_damping", p->linear_damping, 1},
      {"angular_damping", p->angular_damping, 1},
      {"grip", p->grip, 1},
  };
  for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
    const double value = all[i].value;
    if (!(value < 1e12) || !(all[i].may_be_zero ? value >= 0.0 : value > 0.0)) return all[i].name;
  }
  return NULL;
}

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
  const body_parameters *p = parameters;
  memset(self, 0, sizeof *self);
  self->parameters = *p;
  self->body_reach = p->outline != NULL ? p->outline->reach : p->radius;
  self->reach = reach > self->body_reach + BODY_SKIN ? reach : self->body_reach + BODY_SKIN;
  self->force_gain = body_a(p) / p->mass;
  self->drag = p->linear_damping / p->mass;
  self->torque_gain = body_b(p) / p->inertia;
  self->turn_drag = p->angular_damping / p->inertia;
  self->per_radius = 1.0 / p->wheel_radius;
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

double body_energy(const body *self) {
  const body_state *s = &self->state;
  const double spin = self->parameters.slip ? self->slip_spin : self->spin;
  const double left = s->slipping ? s->rim_left : body_left_speed(self);
  const double right = s->slipping ? s->rim_right : body_right_speed(self);
  return 0.5 * (self->mass * (s->speed * s->speed + s->lateral * s->lateral) +
                self->inertia * s->turn_rate * s->turn_rate + spin * (left * left + right * right));
}

double body_wheel_hold(const body *self, double dt) {
  const body_parameters *p = &self->parameters;
  const double straight = 0.5 * self->mass + self->spin; /* at the rim, one of two wheels */
  const double turning = 0.5 * self->inertia / (p->half_track * p->half_track) + self->spin;
  return (straight < turning ? straight : turning) * p->wheel_radius * p->wheel_radius / dt;
}

/* ---- what is near -------------------------------------------------------------------------------------------------- */

/* 1 if the lists are good while the body is within `share` of their slack. */
static inline int knows(const body *self, const arena *where, double share) {
  const body_surroundings *near = &self->near;
  const double dx = self->state.x - near->x;
  const double dy = self->state.y - near->y;
  const double good = share * near->slack;
  return good > 0.0 && dx * dx + dy * dy < good * good && near->version == arena_version(where);
}

void body_look_around(body *self, const arena *where, double share) {
  if (knows(self, where, share)) return;
  body_surroundings *near = &self->near;
  near->x = self->state.x;
  near->y = self->state.y;
  near->version = arena_version(where);
  near->edge_count = near->disc_count = 0;
  const double clearance = arena_clearance(where, near->x, near->y, CLEARANCE_LIMIT + self->reach);
  if (clearance > self->reach + LOOK_AHEAD) {
    near->slack = clearance - self->reach;
    return;
  }
  near->slack = LOOK_AHEAD;
  const double reach = self->reach + LOOK_AHEAD;
  const size_t edges = arena_edges_near(where, near->x, near->y, reach, near->edges, BODY_EDGES_CAPACITY);
  const size_t discs = arena_discs_near(where, near->x, near->y, reach, near->discs, BODY_DISCS_CAPACITY);
  near->edge_count = (uint16_t)(edges > BODY_EDGES_CAPACITY ? BODY_EDGES_CAPACITY + 1 : edges);
  near->disc_count = (uint16_t)(discs > BODY_DISCS_CAPACITY ? BODY_DISCS_CAPACITY + 1 : discs);
}

const uint32_t *body_near_edges(const body *self, const arena *where, size_t *count) {
  const int all = self->near.edge_count > BODY_EDGES_CAPACITY;
  *count = all ? arena_edge_count(where) : self->near.edge_count;
  return all ? NULL : self->near.edges;
}

const uint32_t *body_near_discs(const body *self, const arena *where, size_t *count) {
  const int all = self->near.disc_count > BODY_DISCS_CAPACITY;
  *count = all ? arena_disc_count(where) : self->near.disc_count;
  return all ? NULL : self->near.discs;
}

int body_is_clear(body *self, const arena *where) {
  if (!knows(self, where, 1.0)) body_look_around(self, where, 1.0);
  return self->near.edge_count == 0 && self->near.disc_count == 0;
}

static int mover_meets_segment(const mover *m, double ax, double ay, double bx, double by) {
  if (m->outline == NULL) {
    const arena_disc disc = {.x = m->x, .y = m->y, .radius = m->radius};
    return arena_disc_meets_segment(&disc, ax, ay, bx, by);
  }
  const double px = (ax - m->x) * m->cosine + (ay - m->y) * m->sine; /* in the mover's frame */
  const double py = (ay - m->y) * m->cosine - (ax - m->x) * m->sine;
  const double qx = (bx - m->x) * m->cosine + (by - m->y) * m->sine;
  const double qy = (by - m->y) * m->cosine - (bx - m->x) * m->sine;
  for (size_t i = 0; i < m->corners; i++) {
    const double *a = m->outline + 2 * i;
    const double *b = m->outline + 2 * (i + 1 < m->corners ? i + 1 : 0);
    arena_edge e = {.ax = a[0], .ay = a[1], .ex = b[0] - a[0], .ey = b[1] - a[1]};
    e.length_squared = e.ex * e.ex + e.ey * e.ey;
    if (arena_edge_meets_segment(&e, px, py, qx, qy)) return 1;
  }
  return 0;
}

int body_segment_touches(body *self, const scene *around, double x0, double y0, double x1, double y1, double height) {
  const arena *where = around->arena;
  const int clear = body_is_clear(self, where);
  if (clear && around->movers_count == 0) return 0;
  const body_state *s = &self->state;
  const double ax = s->x + x0 * s->cosine - y0 * s->sine;
  const double ay = s->y + x0 * s->sine + y0 * s->cosine;
  const double bx = s->x + x1 * s->cosine - y1 * s->sine;
  const double by = s->y + x1 * s->sine + y1 * s->cosine;
  size_t count;
  const uint32_t *list = body_near_edges(self, where, &count);
  for (size_t i = 0; i < count; i++) {
    const arena_edge *edge = &arena_edges(where)[list != NULL ? list[i] : i];
    if (edge->height >= height && arena_edge_meets_segment(edge, ax, ay, bx, by)) return 1;
  }
  list = body_near_discs(self, where, &count);
  for (size_t i = 0; i < count; i++) {
    const arena_disc *disc = &arena_discs(where)[list != NULL ? list[i] : i];
    if (disc->height >= height && arena_disc_meets_segment(disc, ax, ay, bx, by)) return 1;
  }
  for (size_t i = 0; i < around->movers_count; i++) {
    const mover *m = &around->movers[i];
    if ((m->id == self->id && self->id != 0) || m->height < height) continue;
    const double reach = m->radius + self->reach;
    if ((m->x - s->x) * (m->x - s->x) + (m->y - s->y) * (m->y - s->y) > reach * reach) continue;
    if (mover_meets_segment(m, ax, ay, bx, by)) return 1;
  }
  return 0;
}

/* ---- speeds ------------------------------------------------------------------------------------------------------- */

static double limited(double value, double limit) { return value > limit ? limit : (value < -limit ? -limit : value); }

/* Tyres that slip, and what the body leans on meanwhile, answer each other until they agree. */
static void slide(body *self, const scene *around, const double limits[2], const double torque[2], double dt) {
  ground floor;
  contacts at = {.count = 0};
  if (self->state.touching) contact_find(self, around, 0.0, BODY_SKIN, &at);
  ground_begin(&floor, self, limits, torque[0], torque[1], dt);
  for (int round = 0; round < SLIP_ROUNDS; round++) {
    double change = ground_round(&floor, self);
    if (at.count > 0) change += contact_stop(self, &at, dt);
    if (change < SLIP_SETTLED) break;
  }
  ground_end(&floor, self, dt);
}

/* Rolling for certain (slip switched off), held across the heading by friction that something may have overcome. */
static void hold_across(body *self, const scene *around, const double limits[2], double dt) {
  body_state *s = &self->state;
  contacts at = {.count = 0};
  if (s->touching) contact_find(self, around, 0.0, BODY_SKIN, &at);
  const double most = (limits[0] + limits[1]) * dt / self->mass;
  double held = 0.0;
  for (int round = 0; round < SLIP_ROUNDS; round++) {
    const double wanted = limited(held - s->lateral, most);
    double change = fabs(wanted - held);
    s->lateral += wanted - held;
    held = wanted;
    if (at.count > 0) change += contact_stop(self, &at, dt);
    if (change < SLIP_SETTLED) return;
  }
}

/* New speeds by the torques: (2.31), (2.32), (3.16), (3.17) while the tyres hold. */
static void drive(body *self, const scene *around, const double torque[2], double dt) {
  body_state *s = &self->state;
  const body_parameters *p = &self->parameters;
  double limits[2];
  if (!s->slipping && !(p->slip && s->touching)) { /* in touch, tyres and contact are solved together */
    double speed = s->speed + dt * (self->force_gain * (torque[0] + torque[1]) - self->drag * s->speed);
    double turn_rate =
        s->turn_rate + dt * (self->torque_gain * (torque[1] - torque[0]) - self->turn_drag * s->turn_rate);
    speed = limited(speed, SPEED_LIMIT);
    turn_rate = limited(turn_rate, TURN_LIMIT);
    if (!p->slip || s->lateral == 0.0) {
      ground_limits(self, around->arena, limits);
      if (!p->slip || ground_holds(self, limits, torque[0], torque[1], speed, turn_rate, dt)) {
        s->speed = speed;
        s->turn_rate = turn_rate;
        if (s->lateral != 0.0) hold_across(self, around, limits, dt);
        return;
      }
    }
  }
  ground_limits(self, around->arena, limits);
  slide(self, around, limits, torque, dt);
  s->speed = limited(s->speed, SPEED_LIMIT);
  s->lateral = limited(s->lateral, SPEED_LIMIT);
  s->turn_rate = limited(s->turn_rate, TURN_LIMIT);
  s->rim_left = limited(s->rim_left, 10.0 * SPEED_LIMIT);
  s->rim_right = limited(s->rim_right, 10.0 * SPEED_LIMIT);
}

/* ---- steps -------------------------------------------------------------------------------------------------------- */

static inline double way_of(const body *self, double dt) {
  const body_state *s = &self->state;
  if (s->lateral == 0.0) return fabs(s->speed) * dt;
  return sqrt(s->speed * s->speed + s->lateral * s->lateral) * dt;
}

/* 1 if nothing can come within the body's reach during the step, in which its middle moves by `way`: it stays within the
 * clear circle around where it looked, and no mover is near. */
static int stays_clear(body *self, const scene *around, double way, double dt) {
  const body_state *s = &self->state;
  const body_surroundings *near = &self->near;
  if (!body_is_clear(self, around->arena)) return 0;
  const double dx = s->x - near->x;
  const double dy = s->y - near->y;
  const double room = near->slack - way;
  if (!(room > 0.0) || dx * dx + dy * dy >= room * room) {
    self->near.slack = -1.0; /* look from here */
    if (!body_is_clear(self, around->arena) || way >= near->slack) return 0;
  }
  for (size_t i = 0; i < around->movers_count; i++) {
    const mover *m = &around->movers[i];
    const double reach = self->body_reach + m->radius + way + contact_mover_speed(m) * dt + LOOK_AHEAD;
    if ((m->x - s->x) * (m->x - s->x) + (m->y - s->y) * (m->y - s->y) < reach * reach) return 0;
  }
  return 1;
}

/* Heading, then position, (3.18)-(3.22), where nothing is in the way. */
static void move_freely(body *self, double way, double dt) {
  body_state *s = &self->state;
  contact_turn(self, s->turn_rate * dt);
  s->x += (s->speed * s->cosine - s->lateral * s->sine) * dt;
  s->y += (s->speed * s->sine + s->lateral * s->cosine) * dt;
  s->distance += way;
  s->touching = 0;
}

static void move_in_contact(body *const bodies[], size_t count, const scene *around, double dt) {
  double from[BODY_MAXIMUM][2];
  for (size_t i = 0; i < count; i++) {
    from[i][0] = bodies[i]->state.x;
    from[i][1] = bodies[i]->state.y;
  }
  contact_move(bodies, count, around, dt);
  for (size_t i = 0; i < count; i++) {
    body_state *s = &bodies[i]->state;
    s->distance += sqrt((s->x - from[i][0]) * (s->x - from[i][0]) + (s->y - from[i][1]) * (s->y - from[i][1]));
  }
}

static void move_alone(body *self, const scene *around, double dt) {
  const double way = way_of(self, dt);
  if (stays_clear(self, around, way, dt)) {
    move_freely(self, way, dt);
  } else {
    move_in_contact(&self, 1, around, dt);
  }
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

int body_advance(body *self, const scene *around, double torque_left, double torque_right, double dt) {
  const double torque[2] = {torque_left, torque_right};
  if (!(dt > 0.0 && dt < 1e6)) return BODY_BAD_STEP;
  if (!is_finite(torque_left, torque_right)) return BODY_BAD_TORQUE;
  drive(self, around, torque, dt);
  move_alone(self, around, dt);
  turn_wheels(self, dt);
  return BODY_OK;
}

/* Numbers the groups of robots that could meet within the step: each gets the least place of its group. */
static void find_groups(body *const bodies[], size_t count, double dt, size_t group[]) {
  for (size_t i = 0; i < count; i++) group[i] = i;
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < i; k++) {
      const body *a = bodies[i];
      const body *b = bodies[k];
      const double reach = a->body_reach + b->body_reach + way_of(a, dt) + way_of(b, dt) + LOOK_AHEAD;
      const double dx = a->state.x - b->state.x;
      const double dy = a->state.y - b->state.y;
      if (dx * dx + dy * dy >= reach * reach || group[i] == group[k]) continue;
      const size_t less = group[i] < group[k] ? group[i] : group[k];
      const size_t more = group[i] < group[k] ? group[k] : group[i];
      for (size_t n = 0; n <= i; n++) {
        if (group[n] == more) group[n] = less;
      }
    }
  }
}

/* Places of the bodies in the order of their ids. */
static int sort(body *const bodies[], size_t count, size_t order[]) {
  for (size_t i = 0; i < count; i++) {
    size_t at = i;
    while (at > 0 && bodies[order[at - 1]]->id > bodies[i]->id) {
      order[at] = order[at - 1];
      at--;
    }
    if (at > 0 && bodies[order[at - 1]]->id == bodies[i]->id) return BODY_SAME_ID;
    order[at] = i;
  }
  return BODY_OK;
}

int body_step(body *const bodies[], size_t count, const scene *around, const double torques[][2], double dt) {
  if (count == 1) return body_advance(bodies[0], around, torques[0][0], torques[0][1], dt);
  if (!(dt > 0.0 && dt < 1e6)) return BODY_BAD_STEP;
  if (count > BODY_MAXIMUM) return BODY_TOO_MANY;
  for (size_t i = 0; i < count; i++) {
    if (!is_finite(torques[i][0], torques[i][1])) return BODY_BAD_TORQUE;
  }
  size_t order[BODY_MAXIMUM];
  const int status = sort(bodies, count, order);
  if (status != BODY_OK) return status;
  body *sorted[BODY_MAXIMUM];
  body *together[BODY_MAXIMUM];
  size_t group[BODY_MAXIMUM];
  for (size_t i = 0; i < count; i++) {
    sorted[i] = bodies[order[i]];
    drive(sorted[i], around, torques[order[i]], dt);
  }
  find_groups(sorted, count, dt, group);
  for (size_t i = 0; i < count; i++) {
    if (group[i] != i) continue;
    size_t members = 0;
    for (size_t k = i; k < count; k++) {
      if (group[k] == i) together[members++] = sorted[k];
    }
    if (members == 1) {
      move_alone(sorted[i], around, dt);
    } else {
      move_in_contact(together, members, around, dt);
    }
  }
  for (size_t i = 0; i < count; i++) turn_wheels(sorted[i], dt);
  return BODY_OK;
}
