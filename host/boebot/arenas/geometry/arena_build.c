/* arena_build.c: an arena is built up, see arena.h. */
#include "arena.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "arena_data.h"

static const arena_surface PLAIN = {.height = 1e300, .infrared_reflectance = 1.0, .sound_reflectance = 1.0};

arena *arena_new(void) {
  arena *self = calloc(1, sizeof *self);
  if (self != NULL) self->index_choice = ARENA_INDEX_LISTS;
  return self;
}

static void index_drop(arena *self) {
  grid_drop(&self->grid);
  ray_lists_destroy(self->lists);
  self->lists = NULL;
}

static void drop_marks(arena_marks *self) {
  for (size_t i = 0; i < self->count; i++) free(self->mark[i].xy);
  free(self->mark);
}

void arena_destroy(arena *self) {
  if (self == NULL) return;
  index_drop(self);
  drop_marks(&self->patches);
  drop_marks(&self->lines);
  for (size_t i = 0; i < self->moving_count; i++) {
    free((void *)self->moving[i].outline);
    free((void *)self->moving[i].path.waypoints);
  }
  free(self->edge);
  free(self->disc);
  free(self->shape);
  free(self->light);
  free(self->moving);
  free(self);
}

/* Room for `more` things of `size` bytes behind `count` of them: arrays have a power of two of places, so that many
 * small additions cost few moves. NULL without memory. */
static void *grown(void *array, size_t count, size_t more, size_t size) {
  size_t places = 8;
  while (places < count) places *= 2;
  if (array != NULL && count + more <= places) return array;
  if (count + more > UINT32_MAX / 4) return NULL;
  while (places < count + more) places *= 2;
  return realloc(array, places * size);
}

/* Least and greatest x and y of points, and a margin about them. */
static void box_of(const double *xy, size_t count, double margin, double box[4]) {
  box[0] = box[2] = xy[0];
  box[1] = box[3] = xy[1];
  for (size_t i = 2; i < 2 * count; i++) {
    if (xy[i] < box[i % 2]) box[i % 2] = xy[i];
    if (xy[i] > box[i % 2 + 2]) box[i % 2 + 2] = xy[i];
  }
  for (int i = 0; i < 2; i++) {
    box[i] -= margin;
    box[i + 2] += margin;
  }
}

static int add_shape(arena *self, const arena_shape *shape) {
  arena_shape *shapes = grown(self->shape, self->shape_count, 1, sizeof *shapes);
  if (shapes == NULL) return -1;
  self->shape = shapes;
  shapes[self->shape_count] = *shape;
  self->version++;
  index_drop(self);
  return (int)self->shape_count++;
}

int arena_add_edges(arena *self, const double *xy, size_t count, int kind, const arena_surface *surface) {
  const size_t added = kind == ARENA_WALL ? count - 1 : count;
  arena_edge *edges = grown(self->edge, self->edge_count, added, sizeof *edges);
  if (edges == NULL) return -1;
  self->edge = edges;
  if (surface == NULL) surface = &PLAIN;
  for (size_t i = 0; i < added; i++) {
    const double *a = &xy[2 * i];
    const double *b = &xy[i + 1 < count ? 2 * i + 2 : 0];
    arena_edge e = {.ax = a[0], .ay = a[1], .ex = b[0] - a[0], .ey = b[1] - a[1], .shape = (int)self->shape_count};
    e.length_squared = e.ex * e.ex + e.ey * e.ey;
    e.height = surface->height;
    edges[self->edge_count + i] = e;
  }
  double box[4];
  box_of(xy, count, 0.0, box);
  const double width = box[2] - box[0];
  const double depth = box[3] - box[1];
  const arena_shape shape = {.kind = kind,
                             .surface = *surface,
                             .first = (uint32_t)self->edge_count,
                             .count = (uint32_t)added,
                             .x = 0.5 * (box[0] + box[2]),
                             .y = 0.5 * (box[1] + box[3]),
                             .radius = 0.5 * sqrt(width * width + depth * depth) * (1.0 + 1e-12)};
  const int number = add_shape(self, &shape);
  if (number >= 0) self->edge_count += added;
  return number;
}

int arena_add_disc(arena *self, double x, double y, double radius, const arena_surface *surface) {
  arena_disc *discs = grown(self->disc, self->disc_count, 1, sizeof *discs);
  if (discs == NULL) return -1;
  self->disc = discs;
  if (surface == NULL) surface = &PLAIN;
  discs[self->disc_count] =
      (arena_disc){.x = x, .y = y, .radius = radius, .height = surface->height, .shape = (int)self->shape_count};
  const arena_shape shape = {.kind = ARENA_DISC,
                             .surface = *surface,
                             .first = (uint32_t)self->disc_count,
                             .count = 1,
                             .x = x,
                             .y = y,
                             .radius = radius};
  const int number = add_shape(self, &shape);
  if (number >= 0) self->disc_count++;
  return number;
}

static void *copied(const void *from, size_t size) {
  void *copy = malloc(size);
  if (copy != NULL) memcpy(copy, from, size);
  return copy;
}

static int add_mark(arena_marks *to, const double *xy, size_t count, double half_width, double value) {
  arena_mark *marks = grown(to->mark, to->count, 1, sizeof *marks);
  if (marks == NULL) return -1;
  to->mark = marks;
  arena_mark added = {
      .xy = copied(xy, 2 * count * sizeof *xy), .count = count, .half_width = half_width, .value = value};
  if (added.xy == NULL) return -1;
  box_of(xy, count, half_width, added.box);
  marks[to->count] = added;
  return (int)to->count++;
}

int arena_add_patch(arena *self, const double *xy, size_t count, double grip) {
  return add_mark(&self->patches, xy, count, 0.0, grip);
}

int arena_add_line(arena *self, const double *xy, size_t count, double width, double reflectance) {
  return add_mark(&self->lines, xy, count, 0.5 * width, reflectance);
}

void arena_set_floor(arena *self, double reflectance) { self->floor_reflectance = reflectance; }

int arena_add_light(arena *self, double x, double y, double height, double power) {
  arena_light *lights = grown(self->light, self->light_count, 1, sizeof *lights);
  if (lights == NULL) return -1;
  self->light = lights;
  lights[self->light_count] = (arena_light){.x = x, .y = y, .height = height, .power = power};
  return (int)self->light_count++;
}

double arena_path_speed(const path_waypoint *waypoints, size_t count, double radius) {
  double fastest = 0.0;
  for (size_t i = 1; i < count; i++) {
    const path_waypoint *a = &waypoints[i - 1];
    const path_waypoint *b = &waypoints[i];
    const double way = sqrt((b->x - a->x) * (b->x - a->x) + (b->y - a->y) * (b->y - a->y));
    fastest = fmax(fastest, (way + radius * fabs(b->heading - a->heading)) / (b->time - a->time));
  }
  return fastest;
}

int arena_add_moving(arena *self, const double *outline, size_t corners, double radius, const arena_surface *surface,
                     const path_waypoint *waypoints, size_t waypoint_count, int repeat) {
  arena_moving added = {.radius = radius, .surface = surface != NULL ? *surface : PLAIN};
  if (outline != NULL) {
    added.radius = 0.0;
    for (size_t i = 0; i < corners; i++) {
      const double r = sqrt(outline[2 * i] * outline[2 * i] + outline[2 * i + 1] * outline[2 * i + 1]);
      if (r > added.radius) added.radius = r;
    }
    added.radius *= 1.0 + 1e-12;
  }
  arena_moving *movings = grown(self->moving, self->moving_count, 1, sizeof *movings);
  if (movings == NULL) return -1;
  self->moving = movings;
  path_waypoint *points = copied(waypoints, waypoint_count * sizeof *points);
  added.outline = outline != NULL ? copied(outline, 2 * corners * sizeof *outline) : NULL;
  if (points == NULL || (outline != NULL && added.outline == NULL)) {
    free(points);
    free((void *)added.outline);
    return -1;
  }
  added.corners = outline != NULL ? corners : 0;
  added.path = (path){.waypoints = points, .count = waypoint_count, .repeat = repeat};
  movings[self->moving_count] = added;
  return (int)self->moving_count++;
}

void arena_set_charger(arena *self, double x, double y, double radius) {
  self->charger = (arena_charger){x, y, radius};
}

void arena_build(arena *self) {
  const grid_items items = arena_items(self);
  index_drop(self);
  if (self->index_choice >= ARENA_INDEX_GRID && grid_build(&self->grid, &items) == 0 &&
      self->index_choice >= ARENA_INDEX_LISTS) {
    self->lists = ray_lists_new(&self->grid, &items);
  }
}

void arena_use_index(arena *self, int choice) {
  self->index_choice = choice;
  arena_build(self);
}

size_t arena_edge_count(const arena *self) { return self->edge_count; }
size_t arena_disc_count(const arena *self) { return self->disc_count; }
size_t arena_light_count(const arena *self) { return self->light_count; }
size_t arena_moving_count(const arena *self) { return self->moving_count; }
const arena_edge *arena_edges(const arena *self) { return self->edge; }
const arena_disc *arena_discs(const arena *self) { return self->disc; }
const arena_light *arena_lights(const arena *self) { return self->light; }
const arena_moving *arena_movings(const arena *self) { return self->moving; }

int arena_is_at_charger(const arena *self, double x, double y) {
  const double dx = x - self->charger.x;
  const double dy = y - self->charger.y;
  return self->charger.radius > 0.0 && dx * dx + dy * dy <= self->charger.radius * self->charger.radius;
}

uint32_t arena_version(const arena *self) { return self->version; }

const arena_shape *arena_shape_at(const arena *self, size_t number) {
  return number < self->shape_count ? &self->shape[number] : NULL;
}
