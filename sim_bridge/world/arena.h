/* arena.h: where things are: closed polygons in the plane, and what can be asked of them.
 *
 * A polygon is an outline (the robot is inside it) or an obstacle (the robot is outside it). Rays follow (3.2)-(3.8) of
 * the notes. Above a few dozen edges a uniform grid limits what a question looks at; answers are the same with and
 * without it. Lengths in m, directions as unit vectors.
 */
#ifndef WORLD_ARENA_H
#define WORLD_ARENA_H

#include <stddef.h>
#include <stdint.h>

/* python: begin */
enum { ARENA_OUTLINE = 0, ARENA_OBSTACLE = 1 };

typedef struct arena arena;

/* An arena without edges, or NULL without memory. */
arena *arena_new(void);
void arena_destroy(arena *self);

/* Adds a closed polygon of `count` >= 3 vertices x0 y0 x1 y1 ...; the last vertex joins the first. Returns its number,
 * or -1 without memory or where an edge has no length. */
int arena_add_polygon(arena *self, const double *xy, size_t count, int kind);

/* Moves a polygon by (dx, dy). Returns 0, or -1 if there is no such polygon. */
int arena_move_polygon(arena *self, int polygon, double dx, double dy);

size_t arena_edge_count(const arena *self);

/* Builds the grid (1), drops it (0), or does what suits the number of edges (-1). Adding a polygon drops it. */
void arena_use_grid(arena *self, int choice);

/* Distance along the ray from (x, y) in direction (cosine, sine) to the nearest edge, or -1 if there is none within
 * `reach`. `edge`, if not NULL, gets the number of the edge that was hit. */
double arena_ray(const arena *self, double x, double y, double cosine, double sine, double reach, size_t *edge);

/* Distance from (x, y) to the nearest edge, at most `limit`. */
double arena_clearance(const arena *self, double x, double y, double limit);

/* 1 if a disc lies in free space: within an outline where there is one, in no obstacle, no edge nearer than `radius`. */
int arena_is_free(const arena *self, double x, double y, double radius);
/* python: end */

typedef struct {
  double ax, ay; /* start */
  double ex, ey; /* end - start */
  double length_squared;
  int polygon;
} arena_edge;

const arena_edge *arena_edges(const arena *self);

/* Changes whenever an edge moves; whoever keeps edges compares it. */
uint32_t arena_version(const arena *self);

/* Squared distance from (x, y) to an edge; the nearest point goes to (qx, qy). */
double arena_edge_distance_squared(const arena_edge *edge, double x, double y, double *qx, double *qy);

/* Distance along the ray from (x, y) in direction (cosine, sine) to the edge, or `best` if it is not met before that. */
double arena_edge_ray(const arena_edge *edge, double x, double y, double cosine, double sine, double best);

/* Edges nearer than `radius` to (x, y), in increasing number. Returns how many there are, even when more than
 * `capacity`. */
size_t arena_edges_near(const arena *self, double x, double y, double radius, uint32_t *edges, size_t capacity);

/* 1 if the segment from (x0, y0) to (x1, y1) meets the edge. */
int arena_edge_meets_segment(const arena_edge *edge, double x0, double y0, double x1, double y1);

#endif
