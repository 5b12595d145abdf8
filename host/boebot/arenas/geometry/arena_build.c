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

void arena_destroy(arena *self) {
  if (self == NULL) return;
  index_drop(self);
  for (size_t i = 0; i < self->patch_count; i++) free(self->patch[i].xy);
  for (size_t i = 0; i < self->line_count; i++) free(self->line[i].xy);
  for (size_t i = 0; i < self->moving_count; i++) {
    free((void *)self->moving[i].outline);
    free((void *)self->moving[i].path.waypoints);
  }
  free(self->edge);
  free(self->disc);
  free(self->shape);
  free(self->patch);
  free(self->line);
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

static int all_finite(const double *values, size_t count) {
  for (size_t i = 0; i < count; i++) {
    if (!(fabs(values[i]) <= ARENA_FARTHEST_M)) return 0;
  }
  return 1;
}

static int share(double value) { return value >= 0.0 && value <= 1.0; }

static int usable(const arena_surface *s) {
  return s == NULL || (s->height > 0.0 && share(s->infrared_reflectance) && share(s->sound_reflectance));
}

/* The circle around a shape's box. */
static void enclose(const arena *self, arena_shape *shape) {
  if (shape->kind == ARENA_DISC) {
    const arena_disc *d = &self->disc[shape->first];
    shape->x = d->x;
    shape->y = d->y;
    shape->radius = d->radius;
    return;
  }
  const grid_items items = arena_items(self);
  double all[4] = {1e300, 1e300, -1e300, -1e300};
  for (uint32_t i = 0; i < shape->count; i++) {
    double box[4];
    grid_item_box(&items, shape->first + i, box);
    for (int k = 0; k < 2; k++) {
      all[k] = fmin(all[k], box[k]);
      all[k + 2] = fmax(all[k + 2], box[k + 2]);
    }
  }
  const double width = all[2] - all[0];
  const double depth = all[3] - all[1];
  shape->x = 0.5 * (all[0] + all[2]);
  shape->y = 0.5 * (all[1] + all[3]);
  shape->radius = 0.5 * sqrt(width * width + depth * depth) * (1.0 + 1e-12);
}

static int add_shape(arena *self, int kind, const arena_surface *surface, size_t first, size_t count) {
  if (!usable(surface)) return -1;
  arena_shape *shapes = grown(self->shape, self->shape_count, 1, sizeof *shapes);
  if (shapes == NULL) return -1;
  self->shape = shapes;
  shapes[self->shape_count] = (arena_shape){
      .kind = kind, .surface = surface != NULL ? *surface : PLAIN, .first = (uint32_t)first, .count = (uint32_t)count};
  self->version++;
  index_drop(self);
  return (int)self->shape_count++;
}

/* Adds `edge_count` edges between `count` points in a row; the last one of a closed shape leads to the first point. */
static int add_edges(arena *self, const double *xy, size_t count, size_t edge_count, int kind,
                     const arena_surface *surface) {
  if (!all_finite(xy, 2 * count)) return -1;
  arena_edge *edges = grown(self->edge, self->edge_count, edge_count, sizeof *edges);
  if (edges == NULL) return -1;
  self->edge = edges;
  for (size_t i = 0; i < edge_count; i++) {
    const double *a = &xy[2 * i];
    const double *b = &xy[i + 1 < count ? 2 * i + 2 : 0];
    arena_edge e = {.ax = a[0], .ay = a[1], .ex = b[0] - a[0], .ey = b[1] - a[1], .shape = (int)self->shape_count};
    e.length_squared = e.ex * e.ex + e.ey * e.ey;
    e.height = surface != NULL ? surface->height : PLAIN.height;
    if (!(e.length_squared >= ARENA_SHORTEST_M * ARENA_SHORTEST_M)) return -1;
    edges[self->edge_count + i] = e;
  }
  const int number = add_shape(self, kind, surface, self->edge_count, edge_count);
  if (number >= 0) self->edge_count += edge_count;
  return number;
}

int arena_add_polygon(arena *self, const double *xy, size_t count, int kind, const arena_surface *surface) {
  if (count < 3 || (kind != ARENA_OUTLINE && kind != ARENA_OBSTACLE)) return -1;
  return add_edges(self, xy, count, count, kind, surface);
}

int arena_add_wall(arena *self, const double *xy, size_t count, const arena_surface *surface) {
  return count < 2 ? -1 : add_edges(self, xy, count, count - 1, ARENA_WALL, surface);
}

int arena_add_disc(arena *self, double x, double y, double radius, const arena_surface *surface) {
  if (!all_finite((const double[]){x, y, radius}, 3) || !(radius > 0.0)) return -1;
  arena_disc *discs = grown(self->disc, self->disc_count, 1, sizeof *discs);
  if (discs == NULL) return -1;
  self->disc = discs;
  discs[self->disc_count] = (arena_disc){.x = x,
                                         .y = y,
                                         .radius = radius,
                                         .height = surface != NULL ? surface->height : PLAIN.height,
                                         .shape = (int)self->shape_count};
  const int number = add_shape(self, ARENA_DISC, surface, self->disc_count, 1);
  if (number >= 0) self->disc_count++;
  return number;
}

static void *copied(const void *from, size_t size) {
  void *copy = malloc(size);
  if (copy != NULL) memcpy(copy, from, size);
  return copy;
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

int arena_add_patch(arena *self, const double *xy, size_t count, double grip) {
  if (count < 3 || !all_finite(xy, 2 * count) || !(grip >= 0.0 && grip < 1e9)) return -1;
  arena_patch *patches = grown(self->patch, self->patch_count, 1, sizeof *patches);
  if (patches == NULL) return -1;
  self->patch = patches;
  arena_patch added = {.xy = copied(xy, 2 * count * sizeof *xy), .count = count, .grip = grip};
  if (added.xy == NULL) return -1;
  box_of(xy, count, 0.0, added.box);
  patches[self->patch_count] = added;
  return (int)self->patch_count++;
}

int arena_add_line(arena *self, const double *xy, size_t count, double width, double reflectance) {
  if (count < 2 || !all_finite(xy, 2 * count) || !(width > 0.0 && width < 1e9)) return -1;
  if (!(reflectance >= 0.0 && reflectance <= 1.0)) return -1;
  arena_line *lines = grown(self->line, self->line_count, 1, sizeof *lines);
  if (lines == NULL) return -1;
  self->line = lines;
  arena_line added = {.xy = copied(xy, 2 * count * sizeof *xy), .count = count, .half_width = 0.5 * width};
  if (added.xy == NULL) return -1;
  added.reflectance = reflectance;
  box_of(xy, count, added.half_width, added.box);
  lines[self->line_count] = added;
  return (int)self->line_count++;
}

void arena_set_floor(arena *self, double reflectance) { self->floor_reflectance = reflectance; }

int arena_add_light(arena *self, double x, double y, double height, double power) {
  if (!all_finite((const double[]){x, y, height, power}, 4) || !(power >= 0.0)) return -1;
  arena_light *lights = grown(self->light, self->light_count, 1, sizeof *lights);
  if (lights == NULL) return -1;
  self->light = lights;
  lights[self->light_count] = (arena_light){.x = x, .y = y, .height = height, .power = power};
  return (int)self->light_count++;
}

static int path_is_good(const path_waypoint *waypoints, size_t count, int repeat) {
  if (count == 0 || repeat < PATH_LOOP || repeat > PATH_ONCE || waypoints[0].time != 0.0) return 0;
  for (size_t i = 0; i < count; i++) {
    const path_waypoint *w = &waypoints[i];
    if (!all_finite((const double[]){w->time, w->x, w->y}, 3) || !(fabs(w->heading) < 1e5)) return 0;
    if (i > 0 && !(w->time - waypoints[i - 1].time >= ARENA_WAYPOINTS_US * 1e-6)) return 0;
  }
  return 1;
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
  if (!path_is_good(waypoints, waypoint_count, repeat) || !usable(surface)) return -1;
  arena_moving added = {.radius = radius, .surface = surface != NULL ? *surface : PLAIN};
  if (outline != NULL) {
    if (corners < 3 || !all_finite(outline, 2 * corners)) return -1;
    added.radius = 0.0;
    for (size_t i = 0; i < corners; i++) {
      const double r = sqrt(outline[2 * i] * outline[2 * i] + outline[2 * i + 1] * outline[2 * i + 1]);
      if (r > added.radius) added.radius = r;
    }
    added.radius *= 1.0 + 1e-12;
  }
  if (!all_finite(&added.radius, 1) || !(added.radius > 0.0)) return -1;
  if (arena_path_speed(waypoints, waypoint_count, added.radius) > ARENA_FASTEST_M_S) return -1;
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

int arena_set_charger(arena *self, double x, double y, double radius) {
  if (!all_finite((const double[]){x, y, radius}, 3) || !(radius > 0.0)) return -1;
  self->charger = (arena_charger){x, y, radius};
  self->has_charger = 1;
  return 0;
}

void arena_build(arena *self) {
  const grid_items items = arena_items(self);
  index_drop(self);
  for (size_t i = 0; i < self->shape_count; i++) enclose(self, &self->shape[i]);
  if (self->index_choice >= ARENA_INDEX_GRID && grid_build(&self->grid, &items) == 0 &&
      self->index_choice >= ARENA_INDEX_LISTS) {
    self->lists = ray_lists_new(&self->grid, &items);
    if (self->lists != NULL && self->index_choice == ARENA_INDEX_LISTS_AT_ONCE) self->lists->patience = 0;
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
  return self->has_charger && dx * dx + dy * dy <= self->charger.radius * self->charger.radius;
}

uint32_t arena_version(const arena *self) { return self->version; }

const arena_shape *arena_shape_at(const arena *self, size_t number) {
  return number < self->shape_count ? &self->shape[number] : NULL;
}
