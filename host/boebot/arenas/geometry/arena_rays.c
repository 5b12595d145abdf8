/* arena_rays.c: the nearest item along a ray, see arena.h: by a walk through the grid, or among all items. */
#include "rays.h"

#include "arena_data.h"

static void ask_disc(const arena *self, const ray *r, double height, uint32_t item, ray_nearest *nearest) {
  const arena_disc *d = &self->disc[item - self->edge_count];
  if (d->height >= height) ray_take(nearest, ray_disc(d, r), item);
}

static void ask_item(const arena *self, const ray *r, double height, uint32_t item, ray_nearest *nearest) {
  if (item >= self->edge_count) {
    ask_disc(self, r, height, item, nearest);
    return;
  }
  const arena_edge *e = &self->edge[item];
  if (e->height >= height) ray_take(nearest, ray_edge(e, r, nearest->distance), item);
}

static void ask_all(const arena *self, const ray *r, double height, ray_nearest *nearest) {
  const uint32_t count = (uint32_t)(self->edge_count + self->disc_count);
  for (uint32_t i = 0; i < count; i++) ask_item(self, r, height, i, nearest);
}

/* The part of the ray in the grid's box, from `*enter` to `*leave`. Returns 0 if there is none. */
static int in_box(const grid *g, const ray *r, double *enter, double *leave) {
  const double from[2] = {r->x, r->y};
  const double along[2] = {r->cosine, r->sine};
  const double low[2] = {g->x0, g->y0};
  const double high[2] = {g->x1, g->y1};
  for (int k = 0; k < 2; k++) {
    if (fabs(along[k]) < 1e-15) {
      if (from[k] < low[k] || from[k] > high[k]) return 0;
      continue;
    }
    double a = (low[k] - from[k]) / along[k];
    double b = (high[k] - from[k]) / along[k];
    if (a > b) {
      const double swap = a;
      a = b;
      b = swap;
    }
    if (a > *enter) *enter = a;
    if (b < *leave) *leave = b;
  }
  return *enter <= *leave;
}

/* Walks the cells that the ray crosses, in order, until what was met lies before the next cell. The ring of empty cells
 * around the grid takes the last step. */
static void walk(const arena *self, const ray *r, double height, ray_nearest *nearest) {
  const grid *g = &self->grid;
  const double far = 1e300;
  double enter = 0.0;
  double end = nearest->distance;
  if (!in_box(g, r, &enter, &end)) return;
  const double gx = (r->x + enter * r->cosine - g->x0) * g->per_metre;
  const double gy = (r->y + enter * r->sine - g->y0) * g->per_metre;
  int column = grid_clamp(gx, g->columns);
  int row = grid_clamp(gy, g->rows);
  const int step_x = r->cosine > 0.0 ? 1 : -1;
  const int step_y = r->sine > 0.0 ? 1 : -1;
  const double delta_x = fabs(r->cosine) > 1e-15 ? g->cell / fabs(r->cosine) : far;
  const double delta_y = fabs(r->sine) > 1e-15 ? g->cell / fabs(r->sine) : far;
  double next_x = delta_x < far ? enter + (r->cosine > 0.0 ? column + 1 - gx : gx - column) * delta_x : far;
  double next_y = delta_y < far ? enter + (r->sine > 0.0 ? row + 1 - gy : gy - row) * delta_y : far;
  const double margin = GRID_MARGIN * g->cell;
  for (;;) {
    const size_t cell = (size_t)row * (size_t)g->columns + (size_t)column;
    for (uint32_t i = g->start[cell]; i < g->start[cell + 1]; i++) ask_item(self, r, height, g->content[i], nearest);
    const double leave = next_x < next_y ? next_x : next_y;
    if (nearest->distance < leave - margin || leave > end) return;
    if (next_x < next_y) {
      column += step_x;
      next_x += delta_x;
      if (column < 0 || column >= g->columns) return;
    } else {
      row += step_y;
      next_y += delta_y;
      if (row < 0 || row >= g->rows) return;
    }
  }
}

double arena_ray(const arena *self, double x, double y, double cosine, double sine, double reach, double height,
                 uint32_t *item) {
  const double length = cosine * cosine + sine * sine;
  if (!(reach > 0.0) || !(x * x + y * y < 1e18) || !(length > 0.5 && length < 2.0)) return -1.0;
  const ray r = {x, y, cosine, sine};
  const double limit = reach < 1e9 ? reach : 1e9;
  ray_nearest nearest = {limit, 0};
  if (self->grid.columns == 0) {
    ask_all(self, &r, height, &nearest);
  } else {
    walk(self, &r, height, &nearest);
  }
  if (!(nearest.distance < limit)) return -1.0;
  if (item != NULL) *item = nearest.item;
  return nearest.distance;
}
