/* ray_lists.c: see ray_lists.h. */
#include "ray_lists.h"

#include <stdlib.h>
#include <string.h>

#define CELL_SHARE 0.4             /* of a grid cell's side */
#define CELL_LEAST 0.05            /* m */
#define SIDE_MAXIMUM 100           /* cells: more of them would not stay in the processor's cache */
#define BORDER 1.0                 /* m around everything where rays may start */
#define GATHER_ENOUGH 256u         /* strips that a cell looks at, if there are so many: about 20 us of work */
#define PATIENCE 128u              /* rays from a cell before it gets lists: by then they cost less than they save */
#define LIST_LONGEST 16u           /* entries; the grid does the rest */
#define MEMORY_LARGEST (64u << 20) /* bytes */
#define LEVELS 512                 /* of distance, by which entries are sorted */

#ifdef __GNUC__

/* Direction as a number in [0, 4] that grows with the angle: 0 along x, 1 along y. No trigonometry. */
static double turn_of(double x, double y) {
  const double share = y / (fabs(x) + fabs(y));
  if (x < 0.0) return 2.0 - share;
  return share < 0.0 ? 4.0 + share : share;
}

static int by_size(const void *a, const void *b) {
  const double x = *(const double *)a;
  const double y = *(const double *)b;
  return (x > y) - (x < y);
}

/* The unit circle, cut wherever cosine or sine is a multiple of 1 / RAY_SECTORS_PER_UNIT. */
static void cut_circle(ray_lists *self) {
  const int n = RAY_SECTORS_PER_UNIT;
  int count = 0;
  double *turn = self->sector_turn;
  for (int k = 0; k < n; k++) {
    const double a = (double)k / n;
    const double b = sqrt(1.0 - a * a);
    const double first = turn_of(b, a);
    const double second = turn_of(a, b);
    for (int quarter = 0; quarter < 4; quarter++) {
      turn[count++] = quarter + first;
      if (k > 0) turn[count++] = quarter + second;
    }
  }
  qsort(turn, (size_t)count, sizeof *turn, by_size);
  turn[count] = 4.0;
  self->sectors = count; /* 4 (2 n - 1): a multiple of RAY_FAN_STEP */
  memset(self->sector_of, RAY_SECTORS_MOST, sizeof self->sector_of);
  for (int k = 0; k < count; k++) {
    /* A direction in the middle of the sector: of length 1, for the sector's cell. */
    const double middle = 0.5 * (turn[k] + turn[k + 1]);
    double y = middle < 1.0 ? middle : (middle < 3.0 ? 2.0 - middle : middle - 4.0);
    double x = middle < 2.0 ? 1.0 - middle : middle - 3.0;
    const double length = sqrt(x * x + y * y);
    x /= length;
    y /= length;
    const int column = (int)(x * n + n);
    const int row = (int)(y * n + n);
    /* Where cosine or sine is 1 itself. */
    const int columns = column == 2 * n - 1 ? 1 : 0;
    const int rows = row == 2 * n - 1 ? 1 : 0;
    for (int r = row; r <= row + rows; r++) {
      for (int c = column; c <= column + columns; c++) self->sector_of[r * RAY_TABLE_SIDE + c] = (uint8_t)k;
    }
  }
}

/* Number of items from `first` on that make one strip: edges of one shape in a row, together shorter than a cell. The
 * last edge of a shape leads somewhere else than to the next one's start, and stays alone. */
static uint32_t strip_length(const ray_lists *self, uint32_t first) {
  const arena_edge *edge = self->items.edge;
  const uint32_t end = (uint32_t)self->items.edge_count;
  double length = 0.0;
  uint32_t count = 0;
  while (count < RAY_STRIP_LONGEST && first + count + 1 < end) {
    const arena_edge *e = &edge[first + count];
    length += sqrt(e->length_squared);
    if (length > self->cell || e[1].shape != e->shape) break;
    count++;
  }
  return count > 1 ? count : 1;
}

static void make_strips(ray_lists *self) {
  const uint32_t total = (uint32_t)(self->items.edge_count + self->items.disc_count);
  for (uint32_t i = 0; i < total;) {
    const uint32_t count = strip_length(self, i);
    for (uint32_t k = 0; k < count; k++) self->strip_of[i + k] = (uint32_t)self->strip_count;
    self->strips[self->strip_count++] = ray_strip(i, count);
    i += count;
  }
  for (size_t i = 0; i < self->items.edge_count; i++) {
    self->start_x[i] = self->items.edge[i].ax;
    self->start_y[i] = self->items.edge[i].ay;
  }
}

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
  const size_t count = items->edge_count + items->disc_count;
  self->cells = calloc(cells, sizeof(ray_list_cell *));
  self->visits = calloc(cells, sizeof *self->visits);
  self->strips = malloc(count * sizeof *self->strips);
  self->strip_of = malloc(count * sizeof *self->strip_of);
  self->start_x = calloc(items->edge_count + RAY_STRIP_LONGEST + 1, sizeof *self->start_x);
  self->start_y = calloc(items->edge_count + RAY_STRIP_LONGEST + 1, sizeof *self->start_y);
  if (self->cells == NULL || self->visits == NULL || self->strips == NULL || self->strip_of == NULL ||
      self->start_x == NULL || self->start_y == NULL) {
    ray_lists_destroy(self);
    return NULL;
  }
  cut_circle(self);
  make_strips(self);
  self->patience = (unsigned)(self->strip_count < PATIENCE ? self->strip_count : PATIENCE);
  return self;
}

void ray_lists_destroy(ray_lists *self) {
  if (self == NULL) return;
  const size_t count = self->cells != NULL ? (size_t)self->columns * (size_t)self->rows : 0;
  for (size_t i = 0; i < count; i++) free(self->cells[i]);
  free(self->cells);
  free(self->visits);
  free(self->strips);
  free(self->strip_of);
  free(self->start_x);
  free(self->start_y);
  free(self);
}

/* A strip as a cell sees it: nothing of it nearer than `bound`; sectors `first` to `first + more`. */
typedef struct {
  uint32_t strip;
  float bound;
  uint16_t level;
  uint8_t first, more;
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

/* Directions between the turns `middle + low` and `middle + high`; wider than everything: all. */
typedef struct {
  double middle, low, high;
} span;

static int sector_at(const ray_lists *self, double turn) {
  int low = 0;
  int high = self->sectors;
  while (high - low > 1) {
    const int half = (low + high) / 2;
    if (self->sector_turn[half] <= turn) {
      low = half;
    } else {
      high = half;
    }
  }
  return low;
}

static void set_sectors(const ray_lists *self, sight *s, const span *seen) {
  double from = seen->middle + seen->low - 1e-9;
  double to = seen->middle + seen->high + 1e-9;
  s->first = 0;
  s->more = (uint8_t)(self->sectors - 1);
  if (to - from >= 3.0) return;
  if (from < 0.0) from += 4.0;
  if (from >= 4.0) from -= 4.0;
  if (to < 0.0) to += 4.0;
  if (to >= 4.0) to -= 4.0;
  const int first = sector_at(self, from);
  const int more = sector_at(self, to) - first;
  s->first = (uint8_t)first;
  s->more = (uint8_t)(more >= 0 ? more : more + self->sectors);
}

/* Widens the span by the direction (x, y). */
static void widen(span *seen, double x, double y) {
  double turn = turn_of(x, y) - seen->middle;
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
  if (seen->middle < 0.0) seen->middle = turn_of(qx - from->x, qy - from->y);
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
    seen->middle = turn_of(dx, dy);
    widen(seen, dx * cosine - dy * sine, dy * cosine + dx * sine);
    widen(seen, dx * cosine + dy * sine, dy * cosine - dx * sine);
  }
  return fabs(distance - d->radius) - from->diagonal;
}

static void see(const ray_lists *self, gathered *all, uint32_t strip, const square *from) {
  const grid_items *items = &self->items;
  const uint32_t first = ray_strip_first(strip);
  span seen = {.middle = -1.0};
  double nearest = 1e300;
  for (uint32_t i = first; i < first + ray_strip_count(strip); i++) {
    const double distance = i < items->edge_count ? see_edge(&items->edge[i], from, &seen)
                                                  : see_disc(&items->disc[i - items->edge_count], from, &seen);
    if (distance < nearest) nearest = distance;
  }
  sight *s = &all->sights[all->count];
  s->strip = strip;
  s->bound = (float)(nearest * (1.0 - 1e-6) - 1e-9);
  set_sectors(self, s, &seen);
  if ((double)s->bound < all->complete) all->count++;
}

/* Strips in the grid's cells between those columns and rows, each once. Returns how many. */
static size_t collect(const ray_lists *self, const int box[4], uint8_t *seen, uint32_t *list) {
  const grid *g = self->grid;
  size_t count = 0;
  for (int r = box[1]; r <= box[3]; r++) {
    for (int c = box[0]; c <= box[2]; c++) {
      const size_t cell = (size_t)r * (size_t)g->columns + (size_t)c;
      for (uint32_t i = g->start[cell]; i < g->start[cell + 1]; i++) {
        const uint32_t strip = self->strip_of[g->content[i]];
        if (seen[strip]) continue;
        seen[strip] = 1;
        list[count++] = self->strips[strip];
      }
    }
  }
  return count;
}

/* Strips around the square, from as far as it takes for GATHER_ENOUGH. */
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
  const size_t total = self->strip_count;
  *all = (gathered){.sights = malloc(total * sizeof(sight)), .complete = 1e30};
  if (all->sights == NULL) return -1;
  if (total <= GATHER_ENOUGH) {
    for (size_t i = 0; i < total; i++) see(self, all, self->strips[i], from);
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

/* Sorts by distance, in LEVELS steps. Returns 0, or -1 without memory. */
static int sort(gathered *all) {
  sight *sorted = malloc((all->count + 1) * sizeof *sorted);
  if (sorted == NULL) return -1;
  float farthest = 1e-3f;
  for (size_t i = 0; i < all->count; i++) {
    if (all->sights[i].bound > farthest) farthest = all->sights[i].bound;
  }
  uint32_t start[LEVELS + 1] = {0};
  for (size_t i = 0; i < all->count; i++) {
    sight *s = &all->sights[i];
    s->level = s->bound > 0.0f ? (uint16_t)(s->bound / farthest * (float)(LEVELS - 1)) : 0;
    start[s->level + 1]++;
  }
  for (int i = 0; i < LEVELS; i++) start[i + 1] += start[i];
  for (size_t i = 0; i < all->count; i++) sorted[start[all->sights[i].level]++] = all->sights[i];
  free(all->sights);
  all->sights = sorted;
  /* Within a level the order is free, but bounds have to grow along a list. */
  float least = 1e30f;
  for (size_t i = all->count; i-- > 0;) {
    if (sorted[i].bound < least) least = sorted[i].bound;
    sorted[i].bound = least;
  }
  return 0;
}

/* Lists of one cell, while they are written. */
typedef struct {
  uint32_t start[RAY_SECTORS_MOST + RAY_FANS_MOST]; /* sectors, then fans */
  uint32_t length[RAY_SECTORS_MOST + RAY_FANS_MOST];
  unsigned sectors, fans;
} layout;

/* Calls for each list that a sight belongs to. */
typedef void with_list(layout *self, unsigned list, const sight *s, void *cell);

static void each_list(layout *self, const gathered *all, with_list *call, void *cell) {
  for (size_t i = 0; i < all->count; i++) {
    const sight *s = &all->sights[i];
    for (unsigned k = 0; k <= s->more; k++) call(self, (s->first + k) % self->sectors, s, cell);
    /* Fans that begin before the sight ends, and end after it begins. */
    const unsigned end = s->first + self->sectors + s->more;
    const unsigned begin = s->first + self->sectors - (RAY_FAN_SECTORS - 1);
    const unsigned last = end / RAY_FAN_STEP;
    const unsigned first = (begin + RAY_FAN_STEP - 1) / RAY_FAN_STEP;
    for (unsigned k = 0; k < self->fans && first + k <= last; k++) {
      call(self, self->sectors + (first + k) % self->fans, s, cell);
    }
  }
}

static void count_sight(layout *self, unsigned list, const sight *s, void *cell) {
  (void)s, (void)cell;
  self->length[list]++;
}

static void write_sight(layout *self, unsigned list, const sight *s, void *cell) {
  if (self->length[list] > LIST_LONGEST) return;
  const uint32_t strip = self->length[list] < LIST_LONGEST ? s->strip : RAY_LIST_END;
  ((ray_list_cell *)cell)->entry[self->start[list] + self->length[list]++] = (ray_list_entry){s->bound, strip};
}

/* The lists of all sectors and fans in one block, each with its end. */
static ray_list_cell *packed(const ray_lists *self, const gathered *all, size_t *size) {
  layout out = {.sectors = (unsigned)self->sectors};
  out.fans = out.sectors / RAY_FAN_STEP;
  const unsigned lists = out.sectors + out.fans;
  each_list(&out, all, count_sight, NULL);
  size_t total = 0;
  for (unsigned i = 0; i < lists; i++) {
    const unsigned k = (out.sectors + i) % lists; /* fans come first: what many rays ask lies close together */
    out.start[k] = (uint32_t)total;
    total += (out.length[k] < LIST_LONGEST ? out.length[k] : LIST_LONGEST) + 1;
    out.length[k] = 0;
  }
  *size = sizeof(ray_list_cell) + total * sizeof(ray_list_entry);
  ray_list_cell *cell = malloc(*size);
  if (cell == NULL) return NULL;
  each_list(&out, all, write_sight, cell);
  for (unsigned k = 0; k < lists; k++) {
    *(k < out.sectors ? &cell->start[k] : &cell->fan_start[k - out.sectors]) = (uint16_t)out.start[k];
    if (out.length[k] > LIST_LONGEST) continue;
    cell->entry[out.start[k] + out.length[k]] = (ray_list_entry){(float)(all->complete * (1.0 - 1e-6)), RAY_LIST_END};
  }
  return cell;
}

static ray_list_cell *made(const ray_lists *self, size_t number, size_t *size) {
  const double half = 0.5 * self->cell * (1.0 + GRID_MARGIN);
  const square from = {
      .x = self->x0 + ((double)(number % (size_t)self->columns) + 0.5) * self->cell,
      .y = self->y0 + ((double)(number / (size_t)self->columns) + 0.5) * self->cell,
      .half = half,
      .diagonal = half * 1.4142135623730951 * (1.0 + 1e-9),
  };
  gathered all;
  if (gather(self, &from, &all) != 0) return NULL;
  ray_list_cell *cell = sort(&all) == 0 ? packed(self, &all, size) : NULL;
  free(all.sights);
  return cell;
}

const ray_list_cell *ray_lists_visit(ray_lists *self, size_t number) {
  const unsigned visits = __atomic_load_n(&self->visits[number], __ATOMIC_RELAXED);
  if (visits < self->patience) {
    __atomic_store_n(&self->visits[number], (uint16_t)(visits + 1), __ATOMIC_RELAXED);
    return NULL;
  }
  if (__atomic_load_n(&self->memory, __ATOMIC_RELAXED) > MEMORY_LARGEST) return NULL;
  size_t size = 0;
  ray_list_cell *cell = made(self, number, &size);
  if (cell == NULL) return NULL;
  ray_list_cell *there = NULL;
  if (!__atomic_compare_exchange_n(&self->cells[number], &there, cell, 0, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE)) {
    free(cell); /* another thread was faster */
    return there;
  }
  __atomic_fetch_add(&self->memory, size, __ATOMIC_RELAXED);
  return cell;
}

#else

ray_lists *ray_lists_new(const grid *g, const grid_items *items) {
  (void)g, (void)items;
  return NULL;
}

void ray_lists_destroy(ray_lists *self) { (void)self; }

const ray_list_cell *ray_lists_visit(ray_lists *self, size_t number) {
  (void)self, (void)number;
  return NULL;
}

#endif
