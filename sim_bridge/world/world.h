/* world.h: one world: an arena, what moves in it, and robots; and its step.
 *
 * The order of events within a step is that of Fig. 3.1 of the notes, from the motors on: torques of the wheels, bodies
 * move (body.h), the arena is updated (moving shapes and robots stand where they are now), sensors read. What drives a
 * robot and what it senses is its owner's: a vehicle with motors and sensors by their models, or the parts that join a
 * board to its pins.
 *
 * A robot that is alone is not in the scene: nobody could sense it.
 */
#ifndef WORLD_WORLD_H
#define WORLD_WORLD_H

#include "body.h"
#include "geometry/arena.h"
#include "geometry/scene.h"

/* What a robot does in a step. */
typedef struct {
  /* The step begins: the torques of its wheels, left and right, N m. */
  void (*torques)(void *owner, double out[2]);

  /* Its body has moved; the scene is that of the step's beginning. NULL: nothing. */
  void (*moved)(void *owner);

  /* The scene stands at the step's end: sensors read. */
  void (*sense)(void *owner);
} world_robot_operations;

typedef struct {
  body *body;
  const world_robot_operations *op;
  void *owner;
} world_robot;

typedef struct {
  const arena *arena;
  double dt;
  uint64_t steps;      /* done; so its time is steps * dt */
  size_t obstacles;    /* moving shapes of the arena */
  mover *movers;       /* obstacles, then room for the robots; the owner's memory */
  world_robot *robots; /* in an order that does not matter; the owner's memory */
  size_t count;
  scene around; /* arena, obstacles and robots as they stand */
} world;

/* A world without robots at its beginning. `movers` has room for arena_moving_count of them and for the robots. */
void world_init(world *self, const arena *where, double dt, mover *movers);

/* One step. */
void world_step(world *self);

/* Its parts, for who looks on in between: torques and bodies, the scene, sensing. */
void world_move(world *self);
void world_update(world *self);
void world_sense(world *self);

/* The arena and its obstacles, without robots. */
static inline scene world_obstacles(const world *self) {
  return (scene){.arena = self->arena, .movers = self->movers, .movers_count = self->obstacles};
}

/* 1 if a disc of `radius` at (x, y) lies in free space, outside of all obstacles and of all robots but `self_id`. */
int world_is_free(const world *self, double x, double y, double radius, uint32_t self_id);

/* Puts an obstacle elsewhere: from now on it goes along its way shifted and turned by as much. Returns 0, and nothing has
 * changed, where the circle around a robot is in that place. */
int world_place_obstacle(world *self, size_t obstacle, double x, double y, double heading);

#endif
