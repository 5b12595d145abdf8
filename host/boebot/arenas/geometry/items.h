/* items.h: what rays and bodies meet: edges and discs. Lengths in m. */
#ifndef GEOMETRY_ITEMS_H
#define GEOMETRY_ITEMS_H

typedef struct {
  double ax, ay; /* start */
  double ex, ey; /* end - start */
  double length_squared;
  double height;
  int shape;
} arena_edge;

typedef struct {
  double x, y, radius, height;
  int shape;
} arena_disc;

/* Squared distance from (x, y) to an edge; the nearest point goes to (qx, qy). */
double arena_edge_distance_squared(const arena_edge *edge, double x, double y, double *qx, double *qy);

/* Distance from (x, y) to the circle of a disc, negative inside; the nearest point goes to (qx, qy). */
double arena_disc_distance(const arena_disc *disc, double x, double y, double *qx, double *qy);

/* 1 if the segment from (x0, y0) to (x1, y1) meets the edge, or the disc. */
int arena_edge_meets_segment(const arena_edge *edge, double x0, double y0, double x1, double y1);
int arena_disc_meets_segment(const arena_disc *disc, double x0, double y0, double x1, double y1);

#endif
