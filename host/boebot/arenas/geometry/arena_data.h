/* arena_data.h: what an arena consists of, for the files that answer questions about it (arena, near, rays, scan). */
#ifndef GEOMETRY_ARENA_DATA_H
#define GEOMETRY_ARENA_DATA_H

#include "arena.h"
#include "grid.h"
#include "ray_lists.h"

/* Something on the floor: a closed polygon, or a line of points with a width. */
typedef struct {
  double *xy;
  size_t count;
  double half_width;
  double value; /* grip, or reflectance */
  double box[4];
} arena_mark;

typedef struct {
  arena_mark *mark;
  size_t count;
} arena_marks;

struct arena {
  arena_edge *edge;
  size_t edge_count;
  arena_disc *disc;
  size_t disc_count;
  arena_shape *shape;
  size_t shape_count;
  arena_marks patches, lines;
  double floor_reflectance;
  arena_light *light;
  size_t light_count;
  arena_moving *moving;
  size_t moving_count;
  arena_charger charger; /* radius 0: none */
  uint32_t version;
  int index_choice;
  grid grid;        /* columns == 0: none */
  ray_lists *lists; /* NULL: none */
};

static inline grid_items arena_items(const arena *self) {
  return (grid_items){self->edge, self->edge_count, self->disc, self->disc_count};
}

#endif
