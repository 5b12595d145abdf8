/* grid.c: see grid.h. */
#include "grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SIDE_MAXIMUM 1024    /* cells */
#define CELLS_PER_ITEM 4.0   /* of the box around everything */
#define CELL_MINIMUM 1e-4    /* m */
#define CONTENT_PER_ITEM 16u /* cells that an item may touch on average ... */
#define CONTENT_FREE 65536u  /* ... beyond this many altogether */

void grid_item_box(const grid_items *items, uint32_t item, double box[4]) {
  if (item < items->edge_count) {
    const arena_edge *e = &items->edge[item];
    const double bx = e->ax + e->ex;
    const double by = e->ay + e->ey;
    box[0] = e->ax < bx ? e->ax : bx;
    box[1] = e->ay < by ? e->ay : by;
    box[2] = e->ax < bx ? bx : e->ax;
    box[3] = e->ay < by ? by : e->ay;
    return;
  }
  const arena_disc *d = &items->disc[item - items->edge_count];
  box[0] = d->x - d->radius;
  box[1] = d->y - d->radius;
  box[2] = d->x + d->radius;
  box[3] = d->y + d->radius;
}

/* 1 if the edge may meet the square of half side `half` around (x, y): no line separates them. */
static int edge_in_square(const arena_edge *e, double x, double y, double half) {
  const double mx = x - (e->ax + 0.5 * e->ex);
  const double my = y - (e->ay + 0.5 * e->ey);
  if (fabs(mx) > half + 0.5 * fabs(e->ex) || fabs(my) > half + 0.5 * fabs(e->ey)) return 0;
  return fabs(mx * e->ey - my * e->ex) <= half * (fabs(e->ex) + fabs(e->ey));
}

/* 1 if the circle of the disc may meet the square: some of the square is inside, some outside. */
static int circle_in_square(const arena_disc *d, double x, double y, double half) {
  const double dx = fabs(x - d->x);
  const double dy = fabs(y - d->y);
  const double near_x = dx > half ? dx - half : 0.0;
  const double near_y = dy > half ? dy - half : 0.0;
  const double square = d->radius * d->radius;
  return near_x * near_x + near_y * near_y <= square * (1.0 + 1e-12) &&
         (dx + half) * (dx + half) + (dy + half) * (dy + half) >= square * (1.0 - 1e-12);
}

/* The columns that an edge may touch in a row, between the columns c0 and c1 of its box. */
static void columns_in_row(const grid *g, const arena_edge *e, int row, int *c0, int *c1) {
  if (fabs(e->ey) < g->cell) return;
  const double low = g->y0 + (row - GRID_MARGIN) * g->cell;
  const double high = g->y0 + (row + 1 + GRID_MARGIN) * g->cell;
  double x0 = e->ax + e->ex * ((low - e->ay) / e->ey);
  double x1 = e->ax + e->ex * ((high - e->ay) / e->ey);
  if (x0 > x1) {
    const double x = x0;
    x0 = x1;
    x1 = x;
  }
  const int first = grid_clamp((x0 - g->x0) * g->per_metre - 0.01, g->columns);
  const int last = grid_clamp((x1 - g->x0) * g->per_metre + 0.01, g->columns);
  if (first > *c0) *c0 = first;
  if (last < *c1) *c1 = last;
}

/* Goes through the cells of one item: counts them in `start` (content NULL), or writes the item into them. */
static void register_item(grid *g, const grid_items *items, uint32_t item) {
  const arena_edge *edge = item < items->edge_count ? &items->edge[item] : NULL;
  double box[4];
  grid_item_box(items, item, box);
  const int left = grid_clamp((box[0] - g->x0) * g->per_metre - GRID_MARGIN, g->columns);
  const int right = grid_clamp((box[2] - g->x0) * g->per_metre + GRID_MARGIN, g->columns);
  const int r0 = grid_clamp((box[1] - g->y0) * g->per_metre - GRID_MARGIN, g->rows);
  const int r1 = grid_clamp((box[3] - g->y0) * g->per_metre + GRID_MARGIN, g->rows);
  const double half = 0.5 * g->cell * (1.0 + 2.0 * GRID_MARGIN);
  for (int r = r0; r <= r1; r++) {
    int c0 = left;
    int c1 = right;
    if (edge != NULL) columns_in_row(g, edge, r, &c0, &c1);
    for (int c = c0; c <= c1; c++) {
      const double x = g->x0 + (c + 0.5) * g->cell;
      const double y = g->y0 + (r + 0.5) * g->cell;
      const int inside = edge != NULL ? edge_in_square(edge, x, y, half)
                                      : circle_in_square(&items->disc[item - items->edge_count], x, y, half);
      if (!inside) continue;
      const size_t cell = (size_t)r * (size_t)g->columns + (size_t)c;
      if (g->content == NULL) {
        g->start[cell + 1]++;
      } else {
        g->content[g->start[cell]++] = item;
      }
    }
  }
}

/* The box around all items. */
static void box_of_all(const grid_items *items, size_t count, double all[4]) {
  all[0] = all[1] = 1e300;
  all[2] = all[3] = -1e300;
  for (uint32_t i = 0; i < count; i++) {
    double box[4];
    grid_item_box(items, i, box);
    for (int k = 0; k < 2; k++) {
      if (box[k] < all[k]) all[k] = box[k];
      if (box[k + 2] > all[k + 2]) all[k + 2] = box[k + 2];
    }
  }
}

/* Lays cells of side `cell` over the box, with a ring around. */
static void lay_out(grid *g, const double box[4], double cell) {
  g->cell = cell;
  g->per_metre = 1.0 / cell;
  g->columns = 3 + (int)number_floor((box[2] - box[0]) * g->per_metre);
  g->rows = 3 + (int)number_floor((box[3] - box[1]) * g->per_metre);
  g->x0 = box[0] - cell;
  g->y0 = box[1] - cell;
  g->x1 = g->x0 + g->columns * cell;
  g->y1 = g->y0 + g->rows * cell;
}

/* Side of the cells: a number of cells per item; a long thin box has fewer. */
static double cell_side(const double box[4], size_t count) {
  const double width = box[2] - box[0];
  const double height = box[3] - box[1];
  const double larger = width > height ? width : height;
  const double thinnest = 0.01 * larger;
  const double area = (width > thinnest ? width : thinnest) * (height > thinnest ? height : thinnest);
  double cell = sqrt(area / (CELLS_PER_ITEM * (double)(count > 4 ? count : 4)));
  if (cell < larger / SIDE_MAXIMUM) cell = larger / SIDE_MAXIMUM;
  return cell > CELL_MINIMUM ? cell : CELL_MINIMUM;
}

/* Counts what lies in each cell. Returns the sum, 0 without memory. */
static size_t count_content(grid *g, const grid_items *items, size_t count) {
  const size_t cells = (size_t)g->columns * (size_t)g->rows;
  free(g->start);
  g->start = calloc(cells + 1, sizeof *g->start);
  if (g->start == NULL) return 0;
  for (uint32_t i = 0; i < count; i++) register_item(g, items, i);
  for (size_t cell = 0; cell < cells; cell++) g->start[cell + 1] += g->start[cell];
  return g->start[cells];
}

int grid_build(grid *self, const grid_items *items) {
  grid_drop(self);
  const size_t count = items->edge_count + items->disc_count;
  double box[4];
  box_of_all(items, count, box);
  if (!(box[2] - box[0] + (box[3] - box[1]) > 0.0) || !(box[2] - box[0] + (box[3] - box[1]) < 1e12)) return -1;
  size_t content;
  double cell = cell_side(box, count);
  do { /* many long edges want larger cells */
    lay_out(self, box, cell);
    content = count_content(self, items, count);
    cell *= 2.0;
  } while (content > CONTENT_PER_ITEM * count + CONTENT_FREE);
  if (content > 0) self->content = malloc(content * sizeof *self->content);
  if (self->content == NULL) {
    grid_drop(self);
    return -1;
  }
  for (uint32_t i = 0; i < count; i++) register_item(self, items, i);
  /* Filling moved each start to its cell's end, which is the next cell's start. */
  memmove(self->start + 1, self->start, (size_t)self->columns * (size_t)self->rows * sizeof *self->start);
  self->start[0] = 0;
  return 0;
}

void grid_drop(grid *self) {
  free(self->start);
  free(self->content);
  memset(self, 0, sizeof *self);
}
