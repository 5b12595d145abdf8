/* ray_lists.h: for each cell of the plane and each sector of directions, what a ray from there may meet, nearest first.
 *
 * A ray asks a short list instead of walking through a grid, and stops where the rest cannot be nearer than what it has
 * met. A cell's lists are made when rays have started in it often enough to pay for them; making them changes no answer,
 * and threads may ask and make at the same time. What memory allows no list for is left to the grid.
 */
#ifndef WORLD_RAY_LISTS_H
#define WORLD_RAY_LISTS_H

#include <stddef.h>
#include <stdint.h>

#include "grid.h"
#include "rays.h"

#define RAY_SECTORS 64
#define RAY_LIST_END UINT32_MAX

typedef struct {
  float bound;   /* nothing of the item is nearer to any point of the cell */
  uint32_t item; /* RAY_LIST_END: beyond `bound` the list is silent */
} ray_list_entry;

typedef struct {
  uint16_t start[RAY_SECTORS];
  ray_list_entry entry[];
} ray_list_cell;

typedef struct {
  double x0, y0, cell, per_metre;
  int columns, rows;
  ray_list_cell **cells; /* columns * rows, NULL: not made yet */
  uint16_t *visits;
  size_t memory; /* bytes in lists */
  const grid *grid;
  grid_items items;
} ray_lists;

/* NULL without memory, or where the compiler offers no atomic operations. */
ray_lists *ray_lists_new(const grid *grid, const grid_items *items);
void ray_lists_destroy(ray_lists *self);

/* Counts a ray that starts in a cell without lists, and makes them when it is time. NULL: there are none. */
const ray_list_cell *ray_lists_visit(ray_lists *self, size_t cell);

/* Direction as a number in [0, 4) that grows with the angle: 0 along x, 1 along y. No trigonometry. */
static inline double ray_turn(double x, double y) {
  const double share = y / (fabs(x) + fabs(y));
  if (x < 0.0) return 2.0 - share;
  return share < 0.0 ? 4.0 + share : share;
}

static inline unsigned ray_sector(double cosine, double sine) {
  return (unsigned)(int)(ray_turn(cosine, sine) * (RAY_SECTORS / 4)) % RAY_SECTORS;
}

#endif
