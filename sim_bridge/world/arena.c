/* arena.c: see arena.h. */
#include "arena.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "numbers.h"

#define GRID_THRESHOLD 48u    /* edges above which the grid pays */
#define GRID_SIDE_MAXIMUM 512 /* cells */
#define CRACK 1e-12           /* rays may pass no shared vertex: edges are longer by this share */

typedef struct {
  uint32_t first;
  uint32_t count;
  int kind;
} polygon;

typedef struct {
  double x0, y0, cell, per_metre;
  int columns, rows;
  uint32_t *start;   /* columns * rows + 1 */
  uint32_t *content; /* edge numbers, increasing within a cell */
} grid;

struct arena {
  arena_edge *edge;
  size_t edge_count;
  polygon *polygon;
  size_t polygon_count;
  double x_minimum, y_minimum, x_maximum, y_maximum;
  uint32_t version;
  int grid_choice;
  grid grid; /* columns == 0: none */
};

arena *arena_new(void) {
  arena *self = calloc(1, sizeof *self);
  if (self != NULL) self->grid_choice = -1;
  return self;
}

static void grid_drop(arena *self) {
  free(self->grid.start);
  free(self->grid.content);
  memset(&self->grid, 0, sizeof self->grid);
}

void arena_destroy(arena *self) {
  if (self == NULL) return;
  grid_drop(self);
  free(self->edge);
  free(self->polygon);
  free(self);
}

size_t arena_edge_count(const arena *self) { return self->edge_count; }
const arena_edge *arena_edges(const arena *self) { return self->edge; }
uint32_t arena_version(const arena *self) { return self->version; }

/* The box around the edges from number `from` on is added to the box. */
static void measure(arena *self, size_t from) {
  if (from == 0) {
    self->x_minimum = self->y_minimum = 1e300;
    self->x_maximum = self->y_maximum = -1e300;
  }
  for (size_t i = from; i < self->edge_count; i++) {
    const arena_edge *e = &self->edge[i];
    if (e->ax < self->x_minimum) self->x_minimum = e->ax;
    if (e->ax > self->x_maximum) self->x_maximum = e->ax;
    if (e->ay < self->y_minimum) self->y_minimum = e->ay;
    if (e->ay > self->y_maximum) self->y_maximum = e->ay;
  }
}

static int clamp_cell(double position, int count) {
  const long long cell = number_floor(position);
  if (cell < 0) return 0;
  return cell >= count ? count - 1 : (int)cell;
}

/* 1 if the edge may meet the cell's box: its line separates the box's corners, or a box side does. */
static int edge_in_cell(const arena_edge *e, double x0, double y0, double side) {
  const double half = 0.5 * side * (1.0 + 1e-9);
  const double mx = x0 + 0.5 * side - (e->ax + 0.5 * e->ex);
  const double my = y0 + 0.5 * side - (e->ay + 0.5 * e->ey);
  const double hx = 0.5 * fabs(e->ex);
  const double hy = 0.5 * fabs(e->ey);
  if (fabs(mx) > half + hx || fabs(my) > half + hy) return 0;
  return fabs(mx * e->ey - my * e->ex) <= half * (fabs(e->ex) + fabs(e->ey)) + 1e-300;
}

static void grid_edge_range(const grid *g, const arena_edge *e, int *c0, int *c1, int *r0, int *r1) {
  const double bx = e->ax + e->ex;
  const double by = e->ay + e->ey;
  *c0 = clamp_cell(((e->ax < bx ? e->ax : bx) - g->x0) * g->per_metre - 1e-9, g->columns);
  *c1 = clamp_cell(((e->ax < bx ? bx : e->ax) - g->x0) * g->per_metre + 1e-9, g->columns);
  *r0 = clamp_cell(((e->ay < by ? e->ay : by) - g->y0) * g->per_metre - 1e-9, g->rows);
  *r1 = clamp_cell(((e->ay < by ? by : e->ay) - g->y0) * g->per_metre + 1e-9, g->rows);
}

/* Fills the grid's cells. Without memory there is no grid, and every question looks at every edge. */
static void grid_build(arena *self) {
  grid_drop(self);
  const int wanted = self->grid_choice == 1 || (self->grid_choice < 0 && self->edge_count > GRID_THRESHOLD);
  if (!wanted || self->edge_count == 0) return;
  grid g = {0};
  const double width = self->x_maximum - self->x_minimum;
  const double height = self->y_maximum - self->y_minimum;
  const double larger = width > height ? width : height;
  int side = 4;
  while (side < GRID_SIDE_MAXIMUM && (size_t)side * (size_t)side < 4 * self->edge_count) side *= 2;
  g.cell = larger / side;
  if (!(g.cell > 1e-6)) return;
  g.per_metre = 1.0 / g.cell;
  g.x0 = self->x_minimum;
  g.y0 = self->y_minimum;
  g.columns = 1 + (int)number_floor(width * g.per_metre);
  g.rows = 1 + (int)number_floor(height * g.per_metre);
  const size_t cells = (size_t)g.columns * (size_t)g.rows;
  g.start = calloc(cells + 1, sizeof *g.start);
  if (g.start == NULL) return;
  for (int pass = 0; pass < 2; pass++) {
    for (size_t i = 0; i < self->edge_count; i++) {
      const arena_edge *e = &self->edge[i];
      int c0, c1, r0, r1;
      grid_edge_range(&g, e, &c0, &c1, &r0, &r1);
      for (int r = r0; r <= r1; r++) {
        for (int c = c0; c <= c1; c++) {
          if (!edge_in_cell(e, g.x0 + c * g.cell, g.y0 + r * g.cell, g.cell)) continue;
          const size_t cell = (size_t)r * (size_t)g.columns + (size_t)c;
          if (pass == 0) {
            g.start[cell + 1]++;
          } else {
            g.content[g.start[cell]++] = (uint32_t)i;
          }
        }
      }
    }
    if (pass == 0) {
      for (size_t cell = 0; cell < cells; cell++) g.start[cell + 1] += g.start[cell];
      g.content = malloc((g.start[cells] + 1u) * sizeof *g.content);
      if (g.content == NULL) {
        free(g.start);
        return;
      }
    } else {
      /* Filling moved each start to its cell's end, which is the next cell's start. */
      memmove(g.start + 1, g.start, cells * sizeof *g.start);
      g.start[0] = 0;
    }
  }
  self->grid = g;
}

void arena_use_grid(arena *self, int choice) {
  self->grid_choice = choice;
  grid_build(self);
}

int arena_add_polygon(arena *self, const double *xy, size_t count, int kind) {
  if (count < 3) return -1;
  arena_edge *edges = realloc(self->edge, (self->edge_count + count) * sizeof *edges);
  if (edges == NULL) return -1;
  self->edge = edges;
  polygon *polygons = realloc(self->polygon, (self->polygon_count + 1) * sizeof *polygons);
  if (polygons == NULL) return -1;
  self->polygon = polygons;
  for (size_t i = 0; i < count; i++) {
    const size_t j = (i + 1) % count;
    arena_edge e = {.ax = xy[2 * i], .ay = xy[2 * i + 1], .polygon = (int)self->polygon_count};
    e.ex = xy[2 * j] - e.ax;
    e.ey = xy[2 * j + 1] - e.ay;
    e.length_squared = e.ex * e.ex + e.ey * e.ey;
    if (!(e.length_squared > 0.0) || !(e.length_squared < 1e300)) return -1;
    edges[self->edge_count + i] = e;
  }
  polygons[self->polygon_count] = (polygon){(uint32_t)self->edge_count, (uint32_t)count, kind};
  self->edge_count += count;
  self->polygon_count++;
  self->version++;
  measure(self, self->edge_count - count);
  grid_drop(self);
  return (int)self->polygon_count - 1;
}

int arena_move_polygon(arena *self, int number, double dx, double dy) {
  if (number < 0 || (size_t)number >= self->polygon_count) return -1;
  const polygon *p = &self->polygon[number];
  for (uint32_t i = 0; i < p->count; i++) {
    self->edge[p->first + i].ax += dx;
    self->edge[p->first + i].ay += dy;
  }
  self->version++;
  measure(self, 0);
  if (self->grid.columns > 0) grid_build(self);
  return 0;
}

double arena_edge_distance_squared(const arena_edge *e, double x, double y, double *qx, double *qy) {
  double along = ((x - e->ax) * e->ex + (y - e->ay) * e->ey) / e->length_squared;
  if (along < 0.0) along = 0.0;
  if (along > 1.0) along = 1.0;
  *qx = e->ax + along * e->ex;
  *qy = e->ay + along * e->ey;
  return (x - *qx) * (x - *qx) + (y - *qy) * (y - *qy);
}

int arena_edge_meets_segment(const arena_edge *e, double x0, double y0, double x1, double y1) {
  const double dx = x1 - x0;
  const double dy = y1 - y0;
  const double wx = x0 - e->ax;
  const double wy = y0 - e->ay;
  double den = e->ey * dx - e->ex * dy; /* (3.6), (3.7) times the sign of den */
  double t = e->ex * wy - e->ey * wx;   /* along the segment */
  double u = dx * wy - dy * wx;         /* along the edge */
  if (den < 0.0) {
    den = -den;
    t = -t;
    u = -u;
  }
  if (den > 1e-12 * e->length_squared) return t >= 0.0 && t <= den && u >= 0.0 && u <= den;
  double qx, qy; /* parallel: they meet if an end of one lies on the other */
  if (arena_edge_distance_squared(e, x0, y0, &qx, &qy) <= 1e-24) return 1;
  if (arena_edge_distance_squared(e, x1, y1, &qx, &qy) <= 1e-24) return 1;
  const arena_edge other = {.ax = x0, .ay = y0, .ex = dx, .ey = dy, .length_squared = dx * dx + dy * dy};
  return other.length_squared > 0.0 && arena_edge_distance_squared(&other, e->ax, e->ay, &qx, &qy) <= 1e-24;
}

/* (3.6)-(3.8) for a ray of unit direction (c, s): the distance, or `best` if the edge is not met before it. */
static inline double ray_edge(const arena_edge *e, double x, double y, double c, double s, double best) {
  const double wx = x - e->ax;
  const double wy = y - e->ay;
  double den = e->ey * c - e->ex * s;
  double t = e->ex * wy - e->ey * wx;
  double u = c * wy - s * wx;
  if (den < 0.0) {
    den = -den;
    t = -t;
    u = -u;
  }
  if (den * den > 1e-24 * e->length_squared) {
    const double slack = CRACK * den;
    /* Clearly behind what was found, by more than rounding: so the nearest does not depend on the order of the edges. */
    if (t < 0.0 || t > best * den * (1.0 + CRACK) || u < -slack || u > den + slack) return best;
    const double d = t / den;
    return d < best ? d : best;
  }
  if (u * u > 1e-24) return best;      /* parallel beside it */
  const double a = -(wx * c + wy * s); /* collinear: the nearer of what lies ahead */
  const double b = a + e->ex * c + e->ey * s;
  double d = best;
  if (a >= 0.0 && a < d) d = a;
  if (b >= 0.0 && b < d) d = b;
  if ((a < 0.0) != (b < 0.0)) d = 0.0; /* the origin lies on the edge */
  return d;
}

double arena_edge_ray(const arena_edge *e, double x, double y, double c, double s, double best) {
  return ray_edge(e, x, y, c, s, best);
}

static double ray_all(const arena *self, double x, double y, double c, double s, double reach, size_t *edge) {
  double best = reach;
  for (size_t i = 0; i < self->edge_count; i++) {
    const double d = ray_edge(&self->edge[i], x, y, c, s, best);
    if (d < best) {
      best = d;
      *edge = i;
    }
  }
  return best;
}

/* Walks the cells that the ray crosses, in order, until a hit lies before the next cell. */
static double ray_grid(const arena *self, double x, double y, double c, double s, double reach, size_t *edge) {
  const grid *g = &self->grid;
  const double gx = (x - g->x0) * g->per_metre;
  const double gy = (y - g->y0) * g->per_metre;
  int column = clamp_cell(gx, g->columns);
  int row = clamp_cell(gy, g->rows);
  const int step_x = c > 0.0 ? 1 : -1;
  const int step_y = s > 0.0 ? 1 : -1;
  const double far = 1e300;
  const double delta_x = fabs(c) > 1e-12 ? g->cell / fabs(c) : far;
  const double delta_y = fabs(s) > 1e-12 ? g->cell / fabs(s) : far;
  double next_x = delta_x < far ? (c > 0.0 ? column + 1 - gx : gx - column) * delta_x : far;
  double next_y = delta_y < far ? (s > 0.0 ? row + 1 - gy : gy - row) * delta_y : far;
  double best = reach;
  for (;;) {
    const size_t cell = (size_t)row * (size_t)g->columns + (size_t)column;
    for (uint32_t i = g->start[cell]; i < g->start[cell + 1]; i++) {
      const double d = ray_edge(&self->edge[g->content[i]], x, y, c, s, best);
      if (d < best) {
        best = d;
        *edge = g->content[i];
      }
    }
    const double leave = next_x < next_y ? next_x : next_y;
    if (best < leave - 1e-9 * g->cell || leave > reach) return best;
    if (next_x < next_y) {
      column += step_x;
      next_x += delta_x;
      if (column < 0 || column >= g->columns) return best;
    } else {
      row += step_y;
      next_y += delta_y;
      if (row < 0 || row >= g->rows) return best;
    }
  }
}

double arena_ray(const arena *self, double x, double y, double cosine, double sine, double reach, size_t *edge) {
  size_t hit = 0;
  double d;
  const int inside = x >= self->x_minimum && x <= self->x_maximum && y >= self->y_minimum && y <= self->y_maximum;
  if (self->grid.columns > 0 && inside) {
    d = ray_grid(self, x, y, cosine, sine, reach, &hit);
  } else {
    d = ray_all(self, x, y, cosine, sine, reach, &hit);
  }
  if (!(d < reach)) return -1.0;
  if (edge != NULL) *edge = hit;
  return d;
}

double arena_clearance(const arena *self, double x, double y, double limit) {
  const grid *g = &self->grid;
  double best = limit * limit;
  double qx, qy;
  if (g->columns == 0) {
    for (size_t i = 0; i < self->edge_count; i++) {
      const double d = arena_edge_distance_squared(&self->edge[i], x, y, &qx, &qy);
      if (d < best) best = d;
    }
    return sqrt(best);
  }
  const int c0 = clamp_cell((x - limit - g->x0) * g->per_metre, g->columns);
  const int c1 = clamp_cell((x + limit - g->x0) * g->per_metre, g->columns);
  const int r0 = clamp_cell((y - limit - g->y0) * g->per_metre, g->rows);
  const int r1 = clamp_cell((y + limit - g->y0) * g->per_metre, g->rows);
  for (int r = r0; r <= r1; r++) {
    for (int c = c0; c <= c1; c++) {
      const size_t cell = (size_t)r * (size_t)g->columns + (size_t)c;
      for (uint32_t i = g->start[cell]; i < g->start[cell + 1]; i++) {
        const double d = arena_edge_distance_squared(&self->edge[g->content[i]], x, y, &qx, &qy);
        if (d < best) best = d;
      }
    }
  }
  return sqrt(best);
}

/* Puts `edge` into a sorted list unless it is there; counts beyond the capacity too (then with repetitions). */
static size_t insert(uint32_t *edges, size_t count, size_t capacity, uint32_t edge) {
  if (count > capacity) return count + 1;
  size_t at = count;
  while (at > 0 && edges[at - 1] > edge) at--;
  if (at > 0 && edges[at - 1] == edge) return count;
  if (count == capacity) return count + 1;
  for (size_t i = count; i > at; i--) edges[i] = edges[i - 1];
  edges[at] = edge;
  return count + 1;
}

size_t arena_edges_near(const arena *self, double x, double y, double radius, uint32_t *edges, size_t capacity) {
  const grid *g = &self->grid;
  const double limit = radius * radius;
  double qx, qy;
  size_t count = 0;
  if (g->columns == 0) {
    for (size_t i = 0; i < self->edge_count; i++) {
      if (arena_edge_distance_squared(&self->edge[i], x, y, &qx, &qy) >= limit) continue;
      if (count < capacity) edges[count] = (uint32_t)i;
      count++;
    }
    return count;
  }
  const int c0 = clamp_cell((x - radius - g->x0) * g->per_metre, g->columns);
  const int c1 = clamp_cell((x + radius - g->x0) * g->per_metre, g->columns);
  const int r0 = clamp_cell((y - radius - g->y0) * g->per_metre, g->rows);
  const int r1 = clamp_cell((y + radius - g->y0) * g->per_metre, g->rows);
  for (int r = r0; r <= r1; r++) {
    for (int c = c0; c <= c1; c++) {
      const size_t cell = (size_t)r * (size_t)g->columns + (size_t)c;
      for (uint32_t i = g->start[cell]; i < g->start[cell + 1]; i++) {
        if (arena_edge_distance_squared(&self->edge[g->content[i]], x, y, &qx, &qy) < limit) {
          count = insert(edges, count, capacity, g->content[i]);
        }
      }
    }
  }
  return count;
}

/* Even-odd rule. Corners are compared by their own coordinates: start plus difference may round to something else. */
static int in_polygon(const arena *self, const polygon *p, double x, double y) {
  int inside = 0;
  for (uint32_t i = 0; i < p->count; i++) {
    const arena_edge *e = &self->edge[p->first + i];
    const arena_edge *following = &self->edge[p->first + (i + 1 < p->count ? i + 1 : 0)];
    if ((e->ay > y) == (following->ay > y)) continue;
    if (x < e->ax + e->ex * ((y - e->ay) / e->ey)) inside = !inside;
  }
  return inside;
}

int arena_is_free(const arena *self, double x, double y, double radius) {
  int outlines = 0;
  int within = 0;
  for (size_t i = 0; i < self->polygon_count; i++) {
    const polygon *p = &self->polygon[i];
    const int inside = in_polygon(self, p, x, y);
    if (p->kind == ARENA_OBSTACLE && inside) return 0;
    if (p->kind == ARENA_OUTLINE) {
      outlines++;
      within += inside;
    }
  }
  if (outlines > 0 && within == 0) return 0;
  return self->edge_count == 0 || arena_clearance(self, x, y, 2.0 * radius) >= radius;
}
