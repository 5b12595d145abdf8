/* arena.h: where things are, and what can be asked of them.
 *
 * Shapes: outlines (closed; the robot is inside), obstacles (closed; the robot is outside), walls (open polylines) and
 * discs, each with a height and reflectances; further friction patches, lights, a charger, and moving shapes on scripted
 * paths. Shapes consist of items that rays and bodies meet: first all edges, then all discs. An arena is built up, then
 * `arena_build` makes its index; from then on it does not change, and any number of worlds and threads may share it.
 * Lengths in m, directions as unit vectors.
 */
#ifndef GEOMETRY_ARENA_H
#define GEOMETRY_ARENA_H

#include <stddef.h>
#include <stdint.h>

#include "items.h"
#include "paths.h"

#define ARENA_SHORTEST_M 1e-9 /* edges are at least as long */
#define RAY_FAN_MOST 32u      /* rays */
#define RAY_FAN_GROUP 4u      /* of them that are asked at once */

/* python: begin */
enum { ARENA_FASTEST_M_S = 100 };    /* of any point of a moving shape: a step of the world goes with its speed */
enum { ARENA_WAYPOINTS_US = 1 };     /* waypoints are at least so far apart in time, or rounds could not be counted */
enum { ARENA_FARTHEST_M = 1000000 }; /* from the origin: beyond it positions lose the precision that rays need */
enum { ARENA_OUTLINE = 0, ARENA_OBSTACLE = 1, ARENA_WALL = 2, ARENA_DISC = 3 };
/* What arena_use_index may choose: every question looks at every item; a grid; lists as well (the default). */
enum { ARENA_INDEX_NONE = 0, ARENA_INDEX_GRID = 1, ARENA_INDEX_LISTS = 2 };

typedef struct arena arena;

typedef struct {
  double height;               /* of the top above the floor; a sensor sees what is at least as high as itself */
  double infrared_reflectance; /* 1: as a white wall */
  double sound_reflectance;    /* 1: as a hard wall */
} arena_surface;

typedef struct {
  int kind;
  arena_surface surface;
  uint32_t first;      /* edge, or disc */
  uint32_t count;      /* of edges; 1 for a disc */
  double x, y, radius; /* of a circle that holds the shape */
} arena_shape;

typedef struct {
  double x, y, height, power; /* power in W, radiated evenly */
} arena_light;

typedef struct {
  double x, y, radius;
} arena_charger;

/* A shape on its way: a disc of `radius`, or an outline in its own frame within a circle of `radius`. */
typedef struct {
  const double *outline; /* x0 y0 x1 y1 ..., NULL: a disc */
  size_t corners;
  double radius;
  arena_surface surface;
  path path;
} arena_moving;

/* An arena without anything in it, or NULL without memory. */
arena *arena_new(void);
void arena_destroy(arena *self);

/* These add something and return its number, or -1 without memory. The caller has checked what boebot.arenas.description
 * checks: finite numbers, edges of some length, values within their ranges. `surface` NULL: infinitely high, reflectances
 * 1. The caller's arrays are copied. A wall is open; an outline's or obstacle's last point leads to its first. */
int arena_add_edges(arena *self, const double *xy, size_t count, int kind, const arena_surface *surface);
int arena_add_disc(arena *self, double x, double y, double radius, const arena_surface *surface);
int arena_add_patch(arena *self, const double *xy, size_t count, double grip);
/* A line that is painted on the floor: through these points, `width` wide. */
int arena_add_line(arena *self, const double *xy, size_t count, double width, double reflectance);
int arena_add_light(arena *self, double x, double y, double height, double power);
/* `outline` NULL: a disc of `radius`. */
int arena_add_moving(arena *self, const double *outline, size_t corners, double radius, const arena_surface *surface,
                     const path_waypoint *waypoints, size_t waypoint_count, int repeat);
/* Speed of the fastest point within `radius` of a shape's origin on its path, m/s; times increase. */
double arena_path_speed(const path_waypoint *waypoints, size_t count, double radius);
void arena_set_charger(arena *self, double x, double y, double radius);

/* Makes the index. Without memory for it every question looks at every item. */
void arena_build(arena *self);

/* Which index answers. The answers are the same. */
void arena_use_index(arena *self, int choice);

size_t arena_edge_count(const arena *self);
size_t arena_disc_count(const arena *self);
const arena_shape *arena_shape_at(const arena *self, size_t number);
size_t arena_light_count(const arena *self);
const arena_light *arena_lights(const arena *self);
size_t arena_moving_count(const arena *self);
const arena_moving *arena_movings(const arena *self);

/* 1 if a robot whose axle's middle is at (x, y) stands at the charging station: on its disc, the rim included. */
int arena_is_at_charger(const arena *self, double x, double y);

/* Distance along the ray from (x, y) in direction (cosine, sine) to the nearest item that is at least `height` high, or
 * -1 if there is none nearer than `reach`. `item`, if not NULL, gets the item met: of equally near ones the first. */
double arena_ray(const arena *self, double x, double y, double cosine, double sine, double reach, double height,
                 uint32_t *item);

/* Directions, of length 1, of up to RAY_FAN_MOST rays from one point, in the frame of what sends them. */
typedef struct {
  uint32_t rays;
  uint32_t alike;              /* bit k: rays 4 k to 4 k + 3 point much the same way */
  double cosine[32], sine[32]; /* the last ray's from there on */
} ray_fan;

/* 1 to 32 directions; fastest where each four follow each other counter-clockwise within 0.61 rad. */
void ray_fan_set(ray_fan *self, const double *cosine, const double *sine, size_t count);

/* Rays from (x, y) in a frame whose x axis points along (cosine, sine); `reach` and `height` as for arena_ray. */
typedef struct {
  const arena *where;
  const ray_fan *rays;
  double x, y, cosine, sine;
  double reach, height;
  double *distances; /* of each ray, to be written: room for a multiple of 4 */
} fan_question;

/* The distances of arena_ray, bit for bit. */
void arena_fan(const fan_question *question);

/* Distance from (x, y) to the nearest edge or circle, at most `limit`. */
double arena_clearance(const arena *self, double x, double y, double limit);

/* 1 if a disc lies in free space: within an outline where there is one, in no obstacle, no item nearer than `radius`. */
int arena_is_free(const arena *self, double x, double y, double radius);

/* Friction coefficient of the floor at (x, y): of the last patch there, `otherwise` where there is none. */
double arena_grip(const arena *self, double x, double y, double otherwise);

/* Share of infrared light that the floor throws back where no line is painted; at first 0. */
void arena_set_floor(arena *self, double reflectance);

/* And at (x, y): of the last line there, or that one. */
double arena_floor_reflectance(const arena *self, double x, double y);

/* The first of a row's points that is the same as the next (nearer than ARENA_SHORTEST_M), -1 if there is none. `closed`:
 * the last one's next is the first. */
int64_t arena_repeated(const double *xy, size_t count, int closed);

/* Two edges of a closed polygon that cross, touch or fold back on each other: 1 and the first such pair; 0 if there are
 * none; -1 without memory. */
int arena_crossing(const double *xy, size_t count, uint32_t *one, uint32_t *other);
/* python: end */

const arena_edge *arena_edges(const arena *self);
const arena_disc *arena_discs(const arena *self);

/* Changes whenever an edge moves; a caller that keeps edges compares it. */
uint32_t arena_version(const arena *self);

/* Edges or discs nearer than `radius` to (x, y), in increasing number; a disc is near from inside as well. Return how
 * many there are, even when more than `capacity`. */
size_t arena_edges_near(const arena *self, double x, double y, double radius, uint32_t *edges, size_t capacity);
size_t arena_discs_near(const arena *self, double x, double y, double radius, uint32_t *discs, size_t capacity);

#endif
