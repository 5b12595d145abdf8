/* crossing.c: whether a polygon is simple, see arena_repeated and arena_crossing in arena.h. A grid finds the pairs of edges that are near
 * each other. */
#include <math.h>
#include <stdlib.h>

#include "arena.h"
#include "grid.h"

typedef struct {
  const double *xy;
  uint32_t count;
} ring;

static const double *corner(const ring *self, uint32_t number) {
  return &self->xy[2 * (size_t)(number < self->count ? number : number - self->count)];
}

/* Twice the area of the triangle: > 0 if r lies to the left of the way from p to q. */
static double side(const double *p, const double *q, const double *r) {
  return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
}

static int apart(const double *a, const double *b, const double *c, const double *d) {
  for (int k = 0; k < 2; k++) {
    if (fmax(a[k], b[k]) < fmin(c[k], d[k]) || fmax(c[k], d[k]) < fmin(a[k], b[k])) return 1;
  }
  return 0;
}

/* The products would underflow for triangles of no size; signs do not. */
static int opposite(double one, double other) { return !((one > 0.0 && other > 0.0) || (one < 0.0 && other < 0.0)); }

/* Neighbours meet in their common corner; they may not go back on each other. */
static int folds(const double *a, const double *b, const double *c) {
  const double ux = b[0] - a[0];
  const double uy = b[1] - a[1];
  const double vx = c[0] - b[0];
  const double vy = c[1] - b[1];
  const double cross = ux * vy - uy * vx;
  return ux * vx + uy * vy < 0.0 && cross * cross <= 1e-24 * (ux * ux + uy * uy) * (vx * vx + vy * vy);
}

static int conflict(const ring *self, uint32_t i, uint32_t j) {
  const double *a = corner(self, i);
  const double *b = corner(self, i + 1);
  const double *c = corner(self, j);
  const double *d = corner(self, j + 1);
  if (j == i + 1) return folds(a, b, d);
  if (i == 0 && j == self->count - 1) return folds(c, d, b);
  if (apart(a, b, c, d)) return 0;
  return opposite(side(a, b, c), side(a, b, d)) && opposite(side(c, d, a), side(c, d, b));
}

/* Pairs in each cell. The first one found by number of its edges is kept. */
static int search(const ring *self, const grid *g, uint32_t *one, uint32_t *other) {
  int found = 0;
  const size_t cells = (size_t)g->columns * (size_t)g->rows;
  for (size_t cell = 0; cell < cells; cell++) {
    for (uint32_t k = g->start[cell]; k < g->start[cell + 1]; k++) {
      for (uint32_t m = k + 1; m < g->start[cell + 1]; m++) {
        const uint32_t i = g->content[k];
        const uint32_t j = g->content[m];
        if (found && (i > *one || (i == *one && j >= *other))) break;
        if (!conflict(self, i, j)) continue;
        found = 1;
        *one = i;
        *other = j;
      }
    }
  }
  return found;
}

int64_t arena_repeated(const double *xy, size_t count, int closed) {
  const ring row = {xy, (uint32_t)count};
  const uint32_t steps = closed ? row.count : row.count - 1;
  for (uint32_t i = 0; i < steps; i++) {
    const double *a = corner(&row, i);
    const double *b = corner(&row, i + 1);
    const double dx = b[0] - a[0];
    const double dy = b[1] - a[1];
    if (!(dx * dx + dy * dy >= ARENA_SHORTEST_M * ARENA_SHORTEST_M)) return i;
  }
  return -1;
}

int arena_crossing(const double *xy, size_t count, uint32_t *one, uint32_t *other) {
  const ring polygon = {xy, (uint32_t)count};
  grid cells = {0};
  arena_edge *edges = malloc((count + 1) * sizeof *edges);
  if (edges == NULL) return -1;
  for (uint32_t i = 0; i < polygon.count; i++) {
    const double *a = corner(&polygon, i);
    const double *b = corner(&polygon, i + 1);
    edges[i] = (arena_edge){.ax = a[0], .ay = a[1], .ex = b[0] - a[0], .ey = b[1] - a[1]};
  }
  const grid_items items = {.edge = edges, .edge_count = count};
  int found = -1;
  if (grid_build(&cells, &items) == 0) {
    found = search(&polygon, &cells, one, other);
    grid_drop(&cells);
  }
  free(edges);
  return found;
}
