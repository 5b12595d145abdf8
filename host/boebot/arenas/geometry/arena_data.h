/* arena_data.h: what an arena consists of, for the files that answer questions about it (arena, near, rays, scan). */
#ifndef GEOMETRY_ARENA_DATA_H
#define GEOMETRY_ARENA_DATA_H

#include "arena.h"
#include "grid.h"
#include "ray_lists.h"

typedef struct {
  double *xy;
  size_t count;
  double grip;
  double box[4];
} arena_patch;

typedef struct {
  double *xy;
  size_t count;
  double half_width, reflectance;
  double box[4];
} arena_line;

struct arena {
  arena_edge *edge;
  size_t edge_count;
  arena_disc *disc;
  size_t disc_count;
  arena_shape *shape;
  size_t shape_count;
  arena_patch *patch;
  size_t patch_count;
  arena_line *line;
  size_t line_count;
  double floor_reflectance;
  arena_light *light;
  size_t light_count;
  arena_moving *moving;
  size_t moving_count;
  arena_charger charger;
  int has_charger;
  uint32_t version;
  int index_choice;
  grid grid;        /* columns == 0: none */
  ray_lists *lists; /* NULL: none */
};

static inline grid_items arena_items(const arena *self) {
  return (grid_items){self->edge, self->edge_count, self->disc, self->disc_count};
}

#endif
