/* arena_near.c: what of an arena is near a point: distances, free space, friction; see arena.h. */
#include <math.h>

#include "arena_data.h"

/* Distance from (x, y) to the edge or circle. */
static double item_distance(const arena *self, uint32_t item, double x, double y) {
  double qx, qy;
  if (item < self->edge_count) return sqrt(arena_edge_distance_squared(&self->edge[item], x, y, &qx, &qy));
  return fabs(arena_disc_distance(&self->disc[item - self->edge_count], x, y, &qx, &qy));
}

/* The nearest item of one cell, if nearer than `best`. */
static double nearest_in_cell(const arena *self, int column, int row, double x, double y, double best) {
  const grid *g = &self->grid;
  const size_t cell = (size_t)row * (size_t)g->columns + (size_t)column;
  for (uint32_t i = g->start[cell]; i < g->start[cell + 1]; i++) {
    const double d = item_distance(self, g->content[i], x, y);
    if (d < best) best = d;
  }
  return best;
}

/* The nearest item in the square ring of cells that lies `ring` cells around (column, row). */
static double nearest_in_ring(const arena *self, int column, int row, int ring, double x, double y, double best) {
  const grid *g = &self->grid;
  for (int r = row - ring; r <= row + ring; r++) {
    if (r < 0 || r >= g->rows) continue;
    const int whole = r == row - ring || r == row + ring || ring == 0;
    for (int c = column - ring; c <= column + ring; c += whole ? 1 : 2 * ring) {
      if (c >= 0 && c < g->columns) best = nearest_in_cell(self, c, r, x, y, best);
    }
  }
  return best;
}

double arena_clearance(const arena *self, double x, double y, double limit) {
  const grid *g = &self->grid;
  double best = limit;
  if (g->columns == 0) {
    for (uint32_t i = 0; i < self->edge_count + self->disc_count; i++) {
      const double d = item_distance(self, i, x, y);
      if (d < best) best = d;
    }
    return best;
  }
  const int column = grid_clamp((x - g->x0) * g->per_metre, g->columns);
  const int row = grid_clamp((y - g->y0) * g->per_metre, g->rows);
  const int rings = g->columns > g->rows ? g->columns : g->rows;
  for (int ring = 0; ring < rings; ring++) {
    /* No point of this ring is nearer than that. */
    if ((ring - 1 - GRID_MARGIN) * g->cell > best) break;
    best = nearest_in_ring(self, column, row, ring, x, y, best);
  }
  return best;
}

/* Puts a number into a sorted list unless it is there; counts beyond the capacity too (then with repetitions). */
static size_t insert(uint32_t *list, size_t count, size_t capacity, uint32_t number) {
  if (count > capacity) return count + 1;
  size_t at = count;
  while (at > 0 && list[at - 1] > number) at--;
  if (at > 0 && list[at - 1] == number) return count;
  if (count == capacity) return count + 1;
  for (size_t i = count; i > at; i--) list[i] = list[i - 1];
  list[at] = number;
  return count + 1;
}

/* Numbers, less `first`, of the items from `first` to before `end` that are nearer than `radius`. */
static size_t items_near(const arena *self, double x, double y, double radius, uint32_t first, uint32_t end,
                         uint32_t *list, size_t capacity) {
  const grid *g = &self->grid;
  size_t count = 0;
  if (g->columns == 0) {
    for (uint32_t i = first; i < end; i++) {
      if (!(item_distance(self, i, x, y) < radius)) continue;
      if (count < capacity) list[count] = i - first;
      count++;
    }
    return count;
  }
  const int c0 = grid_clamp((x - radius - g->x0) * g->per_metre - GRID_MARGIN, g->columns);
  const int c1 = grid_clamp((x + radius - g->x0) * g->per_metre + GRID_MARGIN, g->columns);
  const int r0 = grid_clamp((y - radius - g->y0) * g->per_metre - GRID_MARGIN, g->rows);
  const int r1 = grid_clamp((y + radius - g->y0) * g->per_metre + GRID_MARGIN, g->rows);
  for (int r = r0; r <= r1; r++) {
    for (int c = c0; c <= c1; c++) {
      const size_t cell = (size_t)r * (size_t)g->columns + (size_t)c;
      for (uint32_t i = g->start[cell]; i < g->start[cell + 1]; i++) {
        const uint32_t item = g->content[i];
        if (item < first || item >= end || !(item_distance(self, item, x, y) < radius)) continue;
        count = insert(list, count, capacity, item - first);
      }
    }
  }
  return count;
}

size_t arena_edges_near(const arena *self, double x, double y, double radius, uint32_t *edges, size_t capacity) {
  return items_near(self, x, y, radius, 0, (uint32_t)self->edge_count, edges, capacity);
}

size_t arena_discs_near(const arena *self, double x, double y, double radius, uint32_t *discs, size_t capacity) {
  if (self->disc_count == 0) return 0;
  const uint32_t first = (uint32_t)self->edge_count;
  return items_near(self, x, y, radius, first, first + (uint32_t)self->disc_count, discs, capacity);
}

/* One edge of the even-odd rule: 1 if a ray from (x, y) to the right crosses it. */
static int crosses(double x, double y, double ax, double ay, double bx, double by) {
  if ((ay > y) == (by > y)) return 0;
  return x < ax + (bx - ax) * ((y - ay) / (by - ay));
}

/* Corners are compared by their own coordinates: start plus difference may round to something else. */
static int in_polygon(const arena *self, const arena_shape *s, double x, double y) {
  int inside = 0;
  const arena_edge *edge = &self->edge[s->first];
  for (uint32_t i = 0; i < s->count; i++) {
    const arena_edge *next = &edge[i + 1 < s->count ? i + 1 : 0];
    inside ^= crosses(x, y, edge[i].ax, edge[i].ay, next->ax, next->ay);
  }
  return inside;
}

int arena_is_free(const arena *self, double x, double y, double radius) {
  int outlines = 0;
  int within = 0;
  for (size_t i = 0; i < self->shape_count; i++) {
    const arena_shape *s = &self->shape[i];
    if (s->kind == ARENA_DISC) {
      double qx, qy;
      if (arena_disc_distance(&self->disc[s->first], x, y, &qx, &qy) <= 0.0) return 0;
    } else if (s->kind != ARENA_WALL) {
      const int inside = in_polygon(self, s, x, y);
      if (s->kind == ARENA_OBSTACLE && inside) return 0;
      if (s->kind == ARENA_OUTLINE) {
        outlines++;
        within += inside;
      }
    }
  }
  if (outlines > 0 && within == 0) return 0;
  return self->edge_count + self->disc_count == 0 || arena_clearance(self, x, y, 2.0 * radius) >= radius;
}

static int in_box(const arena_mark *m, double x, double y) {
  return x >= m->box[0] && y >= m->box[1] && x <= m->box[2] && y <= m->box[3];
}

double arena_grip(const arena *self, double x, double y, double otherwise) {
  for (size_t i = self->patches.count; i-- > 0;) {
    const arena_mark *p = &self->patches.mark[i];
    if (!in_box(p, x, y)) continue;
    int inside = 0;
    for (size_t k = 0; k < p->count; k++) {
      const double *a = &p->xy[2 * k];
      const double *b = &p->xy[k + 1 < p->count ? 2 * k + 2 : 0];
      inside ^= crosses(x, y, a[0], a[1], b[0], b[1]);
    }
    if (inside) return p->value;
  }
  return otherwise;
}

/* Whether (x, y) is nearer than `reach` to the segment from a to b. */
static int is_near_segment(double x, double y, const double *a, const double *b, double reach) {
  const double dx = b[0] - a[0], dy = b[1] - a[1];
  const double along = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy);
  const double share = along > 0.0 ? (along < 1.0 ? along : 1.0) : 0.0;
  const double ex = x - (a[0] + share * dx), ey = y - (a[1] + share * dy);
  return ex * ex + ey * ey <= reach * reach;
}

double arena_floor_reflectance(const arena *self, double x, double y) {
  for (size_t i = self->lines.count; i-- > 0;) {
    const arena_mark *l = &self->lines.mark[i];
    if (!in_box(l, x, y)) continue;
    for (size_t k = 0; k + 1 < l->count; k++) {
      if (is_near_segment(x, y, &l->xy[2 * k], &l->xy[2 * k + 2], l->half_width)) return l->value;
    }
  }
  return self->floor_reflectance;
}
