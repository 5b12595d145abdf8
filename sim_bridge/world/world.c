/* world.c: see world.h. */
#include "world.h"

#include "body_step.h"
#include "geometry/numbers.h"

void world_init(world *self, const arena *where, double dt, mover *movers) {
  *self = (world){.arena = where, .dt = dt, .obstacles = arena_moving_count(where), .movers = movers};
  world_update(self);
}

void world_move(world *self) {
  double torques[BODY_MAXIMUM][2];
  body *bodies[BODY_MAXIMUM];
  for (size_t i = 0; i < self->count; i++) {
    const world_robot *r = &self->robots[i];
    bodies[i] = r->body;
    r->op->torques(r->owner, torques[i]);
  }
  const scene obstacles = world_obstacles(self);
  body_step(bodies, self->count, &obstacles, (const double(*)[2])torques, self->dt);
  self->steps++;
  for (size_t i = 0; i < self->count; i++) {
    const world_robot *r = &self->robots[i];
    if (r->op->moved != NULL) r->op->moved(r->owner);
  }
}

void world_update(world *self) {
  if (self->obstacles > 0) {
    scene_moving(self->arena, (double)self->steps * self->dt, self->dt, SCENE_FIRST_MOVER, self->movers);
  }
  size_t robots = 0;
  for (; self->count > 1 && robots < self->count; robots++) {
    body_as_mover(self->robots[robots].body, &self->movers[self->obstacles + robots]);
  }
  self->around = (scene){self->arena, self->movers, self->obstacles + robots};
}

void world_sense(world *self) {
  for (size_t i = 0; i < self->count; i++) self->robots[i].op->sense(self->robots[i].owner);
}

void world_step(world *self) {
  world_move(self);
  world_update(self);
  world_sense(self);
}

int world_is_free(const world *self, double x, double y, double radius, uint32_t self_id) {
  if (!scene_is_free(&self->around, x, y, radius, self_id)) return 0;
  if (self->count != 1 || self->robots[0].body->id == self_id) return 1;
  mover alone;
  body_as_mover(self->robots[0].body, &alone);
  const scene robot = {.arena = self->arena, .movers = &alone, .movers_count = 1};
  return scene_is_free(&robot, x, y, radius, self_id);
}

static int meets_a_robot(const world *self, const mover *m) {
  for (size_t i = 0; i < self->count; i++) {
    const body *b = self->robots[i].body;
    const double apart = mover_distance(m, b->state.x, b->state.y);
    if (!(apart > 0.0 && apart >= b->body_reach)) return 1;
  }
  return 0;
}

int world_place_obstacle(world *self, size_t obstacle, double x, double y, double heading) {
  mover *m = &self->movers[obstacle];
  const mover before = *m;
  path_state way;
  path_at(&arena_movings(self->arena)[obstacle].path, (double)self->steps * self->dt - m->waited, &way);
  m->shift_x = x - way.x;
  m->shift_y = y - way.y;
  m->shift_heading = number_wrap(heading - way.heading);
  world_update(self);
  if (!meets_a_robot(self, m)) return 1;
  *m = before;
  return 0;
}
