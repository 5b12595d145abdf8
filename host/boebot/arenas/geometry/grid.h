/* grid.h: a uniform grid over edges and discs: which items touch a cell.
 *
 * Around the cells that hold something lies one ring of empty ones, so that a walk may step out of them once. Cells are
 * a little larger in the eyes of an item than in those of a point: rounding hides no item.
 */
#ifndef GEOMETRY_GRID_H
#define GEOMETRY_GRID_H

#include <stddef.h>
#include <stdint.h>

#include "items.h"
#include "numbers.h"

#define GRID_MARGIN 1e-6 /* of a cell's side */

typedef struct {
  double x0, y0; /* corner of cell 0, in the ring */
  double x1, y1;
  double cell, per_metre;
  int columns, rows; /* with the ring; 0: no grid */
  uint32_t *start;   /* columns * rows + 1 */
  uint32_t *content; /* items, increasing within a cell */
} grid;

typedef struct {
  const arena_edge *edge;
  size_t edge_count;
  const arena_disc *disc;
  size_t disc_count;
} grid_items;

/* Fills `self`. Returns 0, or -1 without memory or without extent. */
int grid_build(grid *self, const grid_items *items);
void grid_drop(grid *self);

/* The column or row of a position, at the border's if it lies outside. */
static inline int grid_clamp(double position, int count) {
  if (!(position > 0.0)) return 0;
  return position >= (double)count ? count - 1 : (int)position;
}

/* The box of an item: x0 y0 x1 y1. */
void grid_item_box(const grid_items *items, uint32_t item, double box[4]);

#endif
