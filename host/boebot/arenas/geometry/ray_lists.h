/* ray_lists.h: for each cell of the plane and each sector of directions, what a ray from there may meet, nearest first.
 *
 * A ray asks a short list instead of walking through a grid, and stops where the rest cannot be nearer than what it has
 * met. A cell's lists are made when rays have started in it often enough to pay for them; making them changes no answer,
 * and threads may ask and make at the same time. What memory allows no list for is left to the grid.
 */
#ifndef GEOMETRY_RAY_LISTS_H
#define GEOMETRY_RAY_LISTS_H

#include <stddef.h>
#include <stdint.h>

#include "grid.h"
#include "rays.h"

#define RAY_SECTORS_PER_UNIT 16                       /* cells of the table of directions along a unit vector */
#define RAY_TABLE_SIDE (2 * RAY_SECTORS_PER_UNIT + 1) /* of that table */
#define RAY_SECTORS_MOST 128
#define RAY_FAN_STEP 4       /* sectors from one fan's beginning to the next one's */
#define RAY_FAN_SECTORS 18   /* that a fan covers */
#define RAY_FAN_COSINE 0.819 /* of 0.61 rad: RAY_FAN_SECTORS - RAY_FAN_STEP sectors are wider than that */
#define RAY_FANS_MOST (RAY_SECTORS_MOST / RAY_FAN_STEP)
#define RAY_STRIP_LONGEST 15u /* edges */
#define RAY_LIST_END UINT32_MAX

/* Short edges in a row are listed as one strip. */
typedef struct {
  float bound;    /* nothing of the strip is nearer to any point of the cell */
  uint32_t strip; /* first item and number of items, see ray_strip_*; RAY_LIST_END: beyond `bound` the list is silent */
} ray_list_entry;

static inline uint32_t ray_strip(uint32_t first, uint32_t count) { return first | (count - 1) << 28; }
static inline uint32_t ray_strip_first(uint32_t strip) { return strip & 0x0fffffffu; }
static inline uint32_t ray_strip_count(uint32_t strip) { return (strip >> 28) + 1; }

typedef struct {
  uint16_t start[RAY_SECTORS_MOST]; /* of each sector's list */
  /* Of the list of RAY_FAN_SECTORS sectors together, from sector RAY_FAN_STEP i on. */
  uint16_t fan_start[RAY_FANS_MOST];
  ray_list_entry entry[];
} ray_list_cell;

typedef struct {
  double x0, y0, cell, per_metre;
  int columns, rows;
  ray_list_cell **cells; /* columns * rows, NULL: not made yet */
  uint16_t *visits;
  unsigned patience; /* a cell's lists are made after so many rays from there */
  size_t memory;     /* bytes in lists */
  const grid *grid;
  grid_items items;
  uint32_t *strips; /* of all items */
  size_t strip_count;
  uint32_t *strip_of;        /* by item */
  double *start_x, *start_y; /* of all edges, and some more places */
  /* Sectors of directions: between neighbouring multiples of 1 / RAY_SECTORS_PER_UNIT of cosine and sine. */
  int sectors;
  double sector_turn[RAY_SECTORS_MOST + 1];           /* where each begins, see ray_turn; the last is 4 */
  uint8_t sector_of[RAY_TABLE_SIDE * RAY_TABLE_SIDE]; /* by row and column of cosine and sine */
} ray_lists;

/* NULL without memory, or where the compiler offers no atomic operations. */
ray_lists *ray_lists_new(const grid *grid, const grid_items *items);
void ray_lists_destroy(ray_lists *self);

/* Counts a ray that starts in a cell without lists, and makes them when it is time. NULL: there are none. */
const ray_list_cell *ray_lists_visit(ray_lists *self, size_t cell);

#ifdef __GNUC__
/* The lists of the cell around (x, y). NULL: there are none; then `*number` is that of the cell, or SIZE_MAX outside. */
static inline const ray_list_cell *ray_lists_at(const ray_lists *self, double x, double y, size_t *number) {
  const double gx = (x - self->x0) * self->per_metre;
  const double gy = (y - self->y0) * self->per_metre;
  *number = SIZE_MAX;
  if (!(gx >= 0.0 && gy >= 0.0 && gx < self->columns && gy < self->rows)) return NULL;
  *number = (size_t)(int)gy * (size_t)self->columns + (size_t)(int)gx;
  return __atomic_load_n(&self->cells[*number], __ATOMIC_ACQUIRE);
}
#endif

/* The sector of a direction; RAY_SECTORS_MOST: none, the vector's length is not 1. */
static inline unsigned ray_sector(const ray_lists *self, double cosine, double sine) {
  const int column = (int)(cosine * RAY_SECTORS_PER_UNIT + RAY_SECTORS_PER_UNIT);
  const int row = (int)(sine * RAY_SECTORS_PER_UNIT + RAY_SECTORS_PER_UNIT);
  const unsigned place = (unsigned)(row * RAY_TABLE_SIDE + column);
  return place < sizeof self->sector_of ? self->sector_of[place] : RAY_SECTORS_MOST;
}

#endif
