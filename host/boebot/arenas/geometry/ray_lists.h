/* ray_lists.h: for each cell of the plane, what fans of rays from there may meet, nearest first.
 *
 * A fan asks a short list instead of walking through a grid, and stops where the rest cannot be nearer than what it has
 * met. A cell's lists are made when the first fan starts in it; making them changes no answer, and threads may ask and
 * make at the same time.
 */
#ifndef GEOMETRY_RAY_LISTS_H
#define GEOMETRY_RAY_LISTS_H

#include <stddef.h>
#include <stdint.h>

#include "grid.h"
#include "rays.h"

#define RAY_LISTS_PER_TURN 8               /* lists of a cell that begin within one unit of ray_turn */
#define RAY_LISTS (4 * RAY_LISTS_PER_TURN) /* of a cell */
#define RAY_FAN_COSINE 0.819               /* of 0.61 rad, that a list covers from any direction that it is for */
#define RAY_LIST_LONGEST 16                /* entries; the grid does the rest */
#define RAY_LIST_END UINT32_MAX

typedef struct {
  float bound;   /* nothing of the item is nearer to any point of the cell */
  uint32_t item; /* RAY_LIST_END: beyond `bound` the list is silent */
} ray_list_entry;

typedef struct {
  ray_list_entry list[RAY_LISTS][RAY_LIST_LONGEST + 1];
} ray_list_cell;

typedef struct {
  double x0, y0, cell, per_metre;
  int columns, rows;
  ray_list_cell **cells; /* columns * rows, NULL: not made yet */
  const grid *grid;
  grid_items items;
} ray_lists;

/* NULL without memory, or where the compiler offers no atomic operations. */
ray_lists *ray_lists_new(const grid *grid, const grid_items *items);
void ray_lists_destroy(ray_lists *self);

/* The lists of the cell around (x, y). NULL: there are none. */
const ray_list_cell *ray_lists_at(ray_lists *self, double x, double y);

/* Direction as a number in [0, 4) that grows with the angle: 0 along x, 1 along y. No trigonometry. */
static inline double ray_turn(double x, double y) {
  const double share = y / (fabs(x) + fabs(y));
  if (x < 0.0) return 2.0 - share;
  return share < 0.0 ? 4.0 + share : share;
}

/* The list for rays that point to (x, y) or up to 0.61 rad to the left of it. */
static inline unsigned ray_list_for(double x, double y) {
  return (unsigned)(ray_turn(x, y) * RAY_LISTS_PER_TURN) % RAY_LISTS;
}

#endif
