/* ray_lists.c: see ray_lists.h. */
#include "ray_lists.h"

#include <stdlib.h>
#include <string.h>

#define CELL_SHARE 0.4             /* of a grid cell's side */
#define CELL_LEAST 0.05            /* m */
#define SIDE_MAXIMUM 1024          /* cells */
#define BORDER 1.0                 /* m around everything where rays may start */
#define GATHER_ENOUGH 2048u        /* items that a cell looks at, if there are so many */
#define LIST_LONGEST 48u           /* entries; the grid does the rest */
#define MEMORY_LARGEST (64u << 20) /* bytes */
#define LEVELS 512                 /* of distance, by which entries are sorted */

ray_lists *ray_lists_new(const grid *g, const grid_items *items) {
#ifndef __GNUC__
  (void)g, (void)items;
  return NULL;
#else
  ray_lists *self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
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
  self->items = *items;
  const size_t count = (size_t)self->columns * (size_t)self->rows;
  self->cells = calloc(count, sizeof(ray_list_cell *));
  self->visits = calloc(count, sizeof *self->visits);
  if (self->cells == NULL || self->visits == NULL) {
    ray_lists_destroy(self);
    return NULL;
  }
  return self;
#endif
}

void ray_lists_destroy(ray_lists *self) {
  if (self == NULL) return;
  const size_t count = self->cells != NULL ? (size_t)self->columns * (size_t)self->rows : 0;
  for (size_t i = 0; i < count; i++) free(self->cells[i]);
  free(self->cells);
  free(self->visits);
  free(self);
}

#ifdef __GNUC__

/* An item as a cell sees it: nothing of it nearer than `bound`; sectors `first` to `first + more`. */
typedef struct {
  uint32_t item;
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

/* The sectors of directions that lie between the turns `low` and `high` around `middle`. */
static void set_sectors(sight *s, double middle, double low, double high) {
  const double per_turn = RAY_SECTORS / 4;
  const int first = (int)number_floor((middle + low - 1e-9) * per_turn);
  const int last = (int)number_floor((middle + high + 1e-9) * per_turn);
  const int more = last - first;
  s->first = (uint8_t)((unsigned)(first + 4 * RAY_SECTORS) % RAY_SECTORS);
  s->more = (uint8_t)(more < RAY_SECTORS - 1 ? more : RAY_SECTORS - 1);
}

/* Widens [low, high] by the direction (x, y), as a turn from `middle`. */
static void widen(double x, double y, double middle, double *low, double *high) {
  double turn = ray_turn(x, y) - middle;
  if (turn < -2.0) turn += 4.0;
  if (turn >= 2.0) turn -= 4.0;
  if (turn < *low) *low = turn;
  if (turn > *high) *high = turn;
}

static void see_edge(sight *s, const arena_edge *e, const square *from) {
  double qx, qy;
  const double distance = sqrt(arena_edge_distance_squared(e, from->x, from->y, &qx, &qy));
  s->bound = (float)((distance - from->diagonal) * (1.0 - 1e-6) - 1e-9);
  s->first = 0;
  s->more = RAY_SECTORS - 1;
  if (distance <= from->diagonal) return;
  /* Directions from points of the square to points of the edge: the corners bound them. */
  const double dx = e->ax - from->x;
  const double dy = e->ay - from->y;
  const double middle = ray_turn(qx - from->x, qy - from->y);
  double low = 0.0;
  double high = 0.0;
  for (int corner = 0; corner < 4; corner++) {
    const double x = dx + (corner & 1 ? from->half : -from->half);
    const double y = dy + (corner & 2 ? from->half : -from->half);
    widen(x, y, middle, &low, &high);
    widen(x + e->ex, y + e->ey, middle, &low, &high);
  }
  set_sectors(s, middle, low, high);
}

static void see_disc(sight *s, const arena_disc *d, const square *from) {
  const double dx = d->x - from->x;
  const double dy = d->y - from->y;
  const double distance = sqrt(dx * dx + dy * dy);
  const double radius = d->radius + from->diagonal;
  s->bound = (float)((fabs(distance - d->radius) - from->diagonal) * (1.0 - 1e-6) - 1e-9);
  s->first = 0;
  s->more = RAY_SECTORS - 1;
  if (distance <= radius * (1.0 + 1e-9)) return;
  /* Tangents from the square's centre to the circle enlarged by the square. */
  const double sine = radius / distance;
  const double cosine = sqrt(1.0 - sine * sine);
  const double middle = ray_turn(dx, dy);
  double low = 0.0;
  double high = 0.0;
  widen(dx * cosine - dy * sine, dy * cosine + dx * sine, middle, &low, &high);
  widen(dx * cosine + dy * sine, dy * cosine - dx * sine, middle, &low, &high);
  set_sectors(s, middle, low, high);
}

static void see(gathered *all, const grid_items *items, uint32_t item, const square *from) {
  sight *s = &all->sights[all->count];
  s->item = item;
  if (item < items->edge_count) {
    see_edge(s, &items->edge[item], from);
  } else {
    see_disc(s, &items->disc[item - items->edge_count], from);
  }
  if ((double)s->bound < all->complete) all->count++;
}

/* Items in the grid's cells between those columns and rows, each once. Returns how many. */
static size_t collect(const grid *g, const int box[4], uint8_t *seen, uint32_t *list) {
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

/* Looks around from the square, far enough for GATHER_ENOUGH items. Returns 0, or -1 without memory. */
static int gather(const ray_lists *self, const square *from, gathered *all) {
  const grid *g = self->grid;
  const uint32_t total = (uint32_t)(self->items.edge_count + self->items.disc_count);
  *all = (gathered){.sights = malloc(total * sizeof(sight)), .complete = 1e30};
  if (all->sights == NULL) return -1;
  if (total <= GATHER_ENOUGH) {
    for (uint32_t i = 0; i < total; i++) see(all, &self->items, i, from);
    return 0;
  }
  uint8_t *seen = calloc(total, 1);
  uint32_t *list = malloc(total * sizeof *list);
  if (seen == NULL || list == NULL) {
    free(seen);
    free(list);
    free(all->sights);
    return -1;
  }
  size_t count = 0;
  for (double reach = 16.0 * g->cell; count < GATHER_ENOUGH; reach *= 1.5) {
    const int box[4] = {
        grid_clamp((from->x - from->half - reach - g->x0) * g->per_metre - GRID_MARGIN, g->columns),
        grid_clamp((from->y - from->half - reach - g->y0) * g->per_metre - GRID_MARGIN, g->rows),
        grid_clamp((from->x + from->half + reach - g->x0) * g->per_metre + GRID_MARGIN, g->columns),
        grid_clamp((from->y + from->half + reach - g->y0) * g->per_metre + GRID_MARGIN, g->rows),
    };
    count += collect(g, box, seen, list + count);
    all->complete = reach;
    if (box[0] == 0 && box[1] == 0 && box[2] == g->columns - 1 && box[3] == g->rows - 1) {
      all->complete = 1e30;
      break;
    }
  }
  for (size_t i = 0; i < count; i++) see(all, &self->items, list[i], from);
  free(seen);
  free(list);
  return 0;
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

/* The lists of all sectors in one block, each with its end. */
static ray_list_cell *packed(const gathered *all, size_t *size) {
  uint32_t length[RAY_SECTORS] = {0};
  for (size_t i = 0; i < all->count; i++) {
    const sight *s = &all->sights[i];
    for (unsigned k = 0; k <= s->more; k++) length[(s->first + k) % RAY_SECTORS]++;
  }
  size_t total = 0;
  uint32_t start[RAY_SECTORS];
  for (int k = 0; k < RAY_SECTORS; k++) {
    start[k] = (uint32_t)total;
    total += (length[k] < LIST_LONGEST ? length[k] : LIST_LONGEST) + 1;
  }
  *size = sizeof(ray_list_cell) + total * sizeof(ray_list_entry);
  ray_list_cell *cell = malloc(*size);
  if (cell == NULL) return NULL;
  uint32_t filled[RAY_SECTORS] = {0};
  for (size_t i = 0; i < all->count; i++) {
    const sight *s = &all->sights[i];
    for (unsigned k = 0; k <= s->more; k++) {
      const unsigned sector = (s->first + k) % RAY_SECTORS;
      if (filled[sector] > LIST_LONGEST) continue;
      const uint32_t item = filled[sector] < LIST_LONGEST ? s->item : RAY_LIST_END;
      cell->entry[start[sector] + filled[sector]++] = (ray_list_entry){s->bound, item};
    }
  }
  for (int k = 0; k < RAY_SECTORS; k++) {
    cell->start[k] = (uint16_t)start[k];
    if (filled[k] > LIST_LONGEST) continue;
    cell->entry[start[k] + filled[k]] = (ray_list_entry){(float)(all->complete * (1.0 - 1e-6)), RAY_LIST_END};
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
  ray_list_cell *cell = sort(&all) == 0 ? packed(&all, size) : NULL;
  free(all.sights);
  return cell;
}

/* After so many rays the lists have cost less than they save. */
static unsigned visits_wanted(const ray_lists *self) {
  const size_t items = self->items.edge_count + self->items.disc_count;
  return (unsigned)(items < GATHER_ENOUGH ? items : GATHER_ENOUGH);
}

const ray_list_cell *ray_lists_visit(ray_lists *self, size_t number) {
  const unsigned visits = __atomic_load_n(&self->visits[number], __ATOMIC_RELAXED);
  if (visits < visits_wanted(self)) {
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

const ray_list_cell *ray_lists_visit(ray_lists *self, size_t number) {
  (void)self, (void)number;
  return NULL;
}

#endif
