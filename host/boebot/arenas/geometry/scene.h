/* scene.h: what one world has around it at an instant: the arena, and what moves in it.
 *
 * A mover is a robot or an obstacle on its way: a disc or a closed polygon with a pose and a velocity. Rays follow
 * (3.2)-(3.8) of the notes; a ray meets a polygon after it has been transformed into the polygon's own frame. A sensor
 * sees what reaches at least as high above the floor as it sits itself. Lengths in m, angles in rad.
 */
#ifndef GEOMETRY_SCENE_H
#define GEOMETRY_SCENE_H

#include <stddef.h>
#include <stdint.h>

#include "arena.h"

#define SCENE_FIRST_MOVER 0x80000000u /* id of an arena's first moving shape; robots have those below, from 1 on */

/* python: begin */
typedef struct {
  double x, y, cosine, sine; /* pose: its origin and the direction of its x axis */
  double vx, vy, turn_rate;  /* m/s, rad/s */
  double radius;             /* of the disc, or of a circle around the origin that holds the outline */
  const double *outline;     /* corners x0 y0 x1 y1 ... in its own frame; NULL: a disc */
  size_t corners;
  double height;               /* of its top above the floor */
  double infrared_reflectance; /* 1: reflects as a white wall */
  double sound_reflectance;
  uint32_t id;   /* not 0 */
  double waited; /* s by which its path's clock is behind the world's: it waits while it pinches a robot (contact.h) */
  int waits;     /* 1: it waited when the last step ended */
  double stops;  /* s into the step under way at which it stops to wait; only body_step uses it */
  double shift_x, shift_y, shift_heading; /* by which it was put off its way: m, m, rad */
} mover;

typedef struct {
  const arena *arena;
  mover *movers; /* body_step writes how long they waited; nothing else of them, and nobody else anything */
  size_t movers_count;
} scene;

typedef struct {
  double distance;
  double normal_x, normal_y; /* of length 1, towards where the ray comes from */
  double infrared, sound;    /* reflectances of what was met */
  int shape;                 /* of the arena, or -1 - number of the mover */
} ray_hit;

/* Distance along the ray from (x, y) in direction (cosine, sine), of length 1, to the nearest thing, or -1 if there is
 * none nearer than `reach`. The ray runs `height` above the floor and passes the mover `self_id` (0: none). Surfaces are
 * met from both sides. `hit`, if not NULL, is written where something was met. */
double scene_ray(const scene *self, double x, double y, double cosine, double sine, double reach, double height,
                 uint32_t self_id, ray_hit *hit);

/* arena_fan, with what moves in the scene. */
void scene_fan(const scene *self, const fan_question *question, uint32_t self_id);

/* Where the arena's moving shapes are at `time` (s): arena_moving_count of them, with ids from `first_id` on. Their
 * velocities are those that take them evenly to where their paths lead within `dt`. Of each are kept `waited`, `waits` and
 * `stops`, 0 where its path was never held up, and its shift, by which it stands and turns off its way. */
void scene_moving(const arena *where, double time, double dt, uint32_t first_id, mover *out);

/* 1 if a disc of `radius` at (x, y) lies in free space of the arena and outside of all movers but `self_id`. */
int scene_is_free(const scene *self, double x, double y, double radius, uint32_t self_id);

/* Distance from (x, y) to a mover; 0 inside. */
double mover_distance(const mover *self, double x, double y);

/* scene_ray for one mover alone, whatever its id and height. */
double mover_ray(const mover *self, double x, double y, double cosine, double sine, double reach, ray_hit *hit);
/* python: end */

#endif
