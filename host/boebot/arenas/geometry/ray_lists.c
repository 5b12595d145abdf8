/* ray_lists.c: see ray_lists.h. */
#include "ray_lists.h"

#include <stdlib.h>

#define CELL_SHARE 0.4                             /* of a grid cell's side */
#define CELL_LEAST 0.05                            /* m */
#define SIDE_MAXIMUM 100                           /* cells: more of them would not stay in the processor's cache */
#define BORDER 1.0                                 /* m around everything where rays may start */
#define GATHER_ENOUGH 256u                         /* items that a cell looks at, if there are that many */
#define COVERED (1.0 / RAY_LISTS_PER_TURN + 0.611) /* of ray_turn by a list; a rad is one unit or less */

#ifdef __GNUC__

static void lay_out(ray_lists *self, const grid *g) {
  const double width = g->x1 - g->x0 + 2.0 * BORDER;
  const double height = g->y1 - g->y0 + 2.0 * BORDER;
  const double larger = width > height ? width : height;
  self->cell = CELL_SHARE * g->cell;
  if (self->cell < CELL_LEAST) self->cell = CELL_LEAST;
  if (self->cell < larger / SIDE_MAXIMUM) self->cell = larger / SIDE_MAXIMUM;
  self->per_metre = 1.0 / self->cell;
  self->x0 = g->x0 - BORDER;
  self->y0 = g->y0 - BORDER;
  self->columns = 1 + (int)(width * self->per_metre);
  self->rows = 1 + (int)(height * self->per_metre);
  self->grid = g;
}

ray_lists *ray_lists_new(const grid *g, const grid_items *items) {
  ray_lists *self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
  lay_out(self, g);
  self->items = *items;
  const size_t cells = (size_t)self->columns * (size_t)self->rows;
  self->cells = calloc(cells, sizeof(ray_list_cell *));
  if (self->cells != NULL) return self;
  ray_lists_destroy(self);
  return NULL;
}

void ray_lists_destroy(ray_lists *self) {
  if (self == NULL) return;
  const size_t count = self->cells != NULL ? (size_t)self->columns * (size_t)self->rows : 0;
  for (size_t i = 0; i < count; i++) free(self->cells[i]);
  free(self->cells);
  free(self);
}

/* An item as a cell sees it: nothing of it nearer than `bound`, in the directions from the turn `from` on. */
typedef struct {
  uint32_t item;
  float bound;
  double from, width; /* turns */
} sight;

/* The square from whose points the rays start. */
typedef struct {
  double x, y;     /* centre */
  double half;     /* side, a little enlarged */
  double diagonal; /* half of it */
} square;

typedef struct {
  sight *sights;
  size_t count;
  double complete; /* nothing nearer than that is missing */
} gathered;

/* Directions between the turns `middle + low` and `middle + high`. */
typedef struct {
  double middle, low, high;
} span;

/* Widens the span by the direction (x, y). */
static void widen(span *seen, double x, double y) {
  double turn = ray_turn(x, y) - seen->middle;
  if (turn < -2.0) turn += 4.0;
  if (turn >= 2.0) turn -= 4.0;
  if (turn < seen->low) seen->low = turn;
  if (turn > seen->high) seen->high = turn;
}

static void see_everywhere(span *seen) {
  seen->low = -2.0;
  seen->high = 2.0;
}

/* Returns the least distance of the edge from the square. */
static double see_edge(const arena_edge *e, const square *from, span *seen) {
  double qx, qy;
  const double distance = sqrt(arena_edge_distance_squared(e, from->x, from->y, &qx, &qy));
  if (distance <= from->diagonal) {
    see_everywhere(seen);
    return 0.0;
  }
  /* Directions from points of the square to points of the edge: the corners bound them. */
  const double dx = e->ax - from->x;
  const double dy = e->ay - from->y;
  seen->middle = ray_turn(qx - from->x, qy - from->y);
  for (int corner = 0; corner < 4; corner++) {
    const double x = dx + (corner & 1 ? from->half : -from->half);
    const double y = dy + (corner & 2 ? from->half : -from->half);
    widen(seen, x, y);
    widen(seen, x + e->ex, y + e->ey);
  }
  return distance - from->diagonal;
}

static double see_disc(const arena_disc *d, const square *from, span *seen) {
  const double dx = d->x - from->x;
  const double dy = d->y - from->y;
  const double distance = sqrt(dx * dx + dy * dy);
  const double radius = d->radius + from->diagonal;
  if (distance <= radius * (1.0 + 1e-9)) {
    see_everywhere(seen);
  } else {
    /* Tangents from the square's centre to the circle enlarged by the square. */
    const double sine = radius / distance;
    const double cosine = sqrt(1.0 - sine * sine);
    seen->middle = ray_turn(dx, dy);
    widen(seen, dx * cosine - dy * sine, dy * cosine + dx * sine);
    widen(seen, dx * cosine + dy * sine, dy * cosine - dx * sine);
  }
  return fabs(distance - d->radius) - from->diagonal;
}

static void see(const ray_lists *self, gathered *all, uint32_t item, const square *from) {
  const grid_items *items = &self->items;
  span seen = {0};
  const double distance = item < items->edge_count ? see_edge(&items->edge[item], from, &seen)
                                                   : see_disc(&items->disc[item - items->edge_count], from, &seen);
  const sight s = {
      .item = item,
      .bound = (float)(distance * (1.0 - 1e-6) - 1e-9),
      .from = seen.middle + seen.low - 1e-9,
      .width = seen.high - seen.low + 2e-9,
  };
  if ((double)s.bound < all->complete) all->sights[all->count++] = s;
}

/* Items in the grid's cells between those columns and rows, each once. Returns how many. */
static size_t collect(const ray_lists *self, const int box[4], uint8_t *seen, uint32_t *list) {
  const grid *g = self->grid;
  size_t count = 0;
  for (int r = box[1]; r <= box[3]; r++) {
    for (int c = box[0]; c <= box[2]; c++) {
      const size_t cell = (size_t)r * (size_t)g->columns + (size_t)c;
      for (uint32_t i = g->start[cell]; i < g->start[cell + 1]; i++) {
        const uint32_t item = g->content[i];
        if (seen[item]) continue;
        seen[item] = 1;
        list[count++] = item;
      }
    }
  }
  return count;
}

/* Items around the square, from as far as it takes for GATHER_ENOUGH. */
static size_t collect_near(const ray_lists *self, const square *from, uint8_t *seen, uint32_t *list, double *complete) {
  const grid *g = self->grid;
  size_t count = 0;
  for (double reach = 16.0 * g->cell; count < GATHER_ENOUGH; reach *= 1.5) {
    const int box[4] = {
        grid_clamp((from->x - from->half - reach - g->x0) * g->per_metre - GRID_MARGIN, g->columns),
        grid_clamp((from->y - from->half - reach - g->y0) * g->per_metre - GRID_MARGIN, g->rows),
        grid_clamp((from->x + from->half + reach - g->x0) * g->per_metre + GRID_MARGIN, g->columns),
        grid_clamp((from->y + from->half + reach - g->y0) * g->per_metre + GRID_MARGIN, g->rows),
    };
    count += collect(self, box, seen, list + count);
    *complete = reach;
    if (box[0] == 0 && box[1] == 0 && box[2] == g->columns - 1 && box[3] == g->rows - 1) {
      *complete = 1e30;
      break;
    }
  }
  return count;
}

/* Looks around from the square. Returns 0, or -1 without memory. */
static int gather(const ray_lists *self, const square *from, gathered *all) {
  const size_t total = self->items.edge_count + self->items.disc_count;
  *all = (gathered){.sights = malloc(total * sizeof(sight)), .complete = 1e30};
  if (all->sights == NULL) return -1;
  if (total <= GATHER_ENOUGH) {
    for (size_t i = 0; i < total; i++) see(self, all, (uint32_t)i, from);
    return 0;
  }
  uint8_t *seen = calloc(total, 1);
  uint32_t *list = malloc(total * sizeof *list);
  if (seen != NULL && list != NULL) {
    const size_t count = collect_near(self, from, seen, list, &all->complete);
    for (size_t i = 0; i < count; i++) see(self, all, list[i], from);
  }
  const int failed = seen == NULL || list == NULL;
  free(seen);
  free(list);
  if (failed) free(all->sights);
  return failed ? -1 : 0;
}

static int by_bound(const void *a, const void *b) {
  const float x = ((const sight *)a)->bound;
  const float y = ((const sight *)b)->bound;
  return (x > y) - (x < y);
}

/* The turn from `a` on to `b`, in [0, 4). */
static double turn_between(double a, double b) {
  const double turn = b - a;
  return turn < 0.0 ? turn + 4.0 : (turn >= 4.0 ? turn - 4.0 : turn);
}

/* Writes the list of the directions from the turn `begin` on. */
static void write_list(const gathered *all, double begin, ray_list_entry *entry) {
  size_t length = 0;
  for (size_t i = 0; i < all->count; i++) {
    const sight *s = &all->sights[i];
    if (turn_between(begin, s->from) > COVERED && turn_between(s->from, begin) > s->width) continue;
    entry[length] = (ray_list_entry){s->bound, length < RAY_LIST_LONGEST ? s->item : RAY_LIST_END};
    if (length++ == RAY_LIST_LONGEST) return;
  }
  entry[length] = (ray_list_entry){(float)(all->complete * (1.0 - 1e-6)), RAY_LIST_END};
}

static ray_list_cell *made(const ray_lists *self, size_t number) {
  const double half = 0.5 * self->cell * (1.0 + GRID_MARGIN);
  const square from = {
      .x = self->x0 + ((double)(number % (size_t)self->columns) + 0.5) * self->cell,
      .y = self->y0 + ((double)(number / (size_t)self->columns) + 0.5) * self->cell,
      .half = half,
      .diagonal = half * 1.4142135623730951 * (1.0 + 1e-9),
  };
  gathered all;
  if (gather(self, &from, &all) != 0) return NULL;
  ray_list_cell *cell = malloc(sizeof *cell);
  if (cell != NULL) {
    qsort(all.sights, all.count, sizeof *all.sights, by_bound);
    for (int k = 0; k < RAY_LISTS; k++) write_list(&all, (double)k / RAY_LISTS_PER_TURN, cell->list[k]);
  }
  free(all.sights);
  return cell;
}

/* Makes the lists of a cell in which a fan starts for the first time. */
static const ray_list_cell *visit(ray_lists *self, size_t number) {
  ray_list_cell *cell = made(self, number);
  if (cell == NULL) return NULL;
  ray_list_cell *there = NULL;
  if (!__atomic_compare_exchange_n(&self->cells[number], &there, cell, 0, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE)) {
    free(cell); /* another thread was faster */
    return there;
  }
  return cell;
}

const ray_list_cell *ray_lists_at(ray_lists *self, double x, double y) {
  const double gx = (x - self->x0) * self->per_metre;
  const double gy = (y - self->y0) * self->per_metre;
  if (!(gx >= 0.0 && gy >= 0.0 && gx < self->columns && gy < self->rows)) return NULL;
  const size_t number = (size_t)(int)gy * (size_t)self->columns + (size_t)(int)gx;
  const ray_list_cell *cell = __atomic_load_n(&self->cells[number], __ATOMIC_ACQUIRE);
  return cell != NULL ? cell : visit(self, number);
}

#else

ray_lists *ray_lists_new(const grid *g, const grid_items *items) {
  (void)g, (void)items;
  return NULL;
}

void ray_lists_destroy(ray_lists *self) { (void)self; }

const ray_list_cell *ray_lists_at(ray_lists *self, double x, double y) {
  (void)self, (void)x, (void)y;
  return NULL;
}

#endif
