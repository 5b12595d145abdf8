/* scan_fan.h: a fan of beams and edges before it, for scan_look.c and scan_edges.c. */
#ifndef GEOMETRY_SCAN_FAN_H
#define GEOMETRY_SCAN_FAN_H

#include "rays.h"
#include "scan.h"

#define SCAN_BLOCK 64u          /* edges that are looked at together */
#define SCAN_BEARING_ERROR 2e-5 /* rad: what bearings of ends may err, and some more */

/* Edges in a row of one frame, from the sensor. */
typedef struct {
  size_t count;
  double c, s;                                                           /* where the fan's middle points to */
  double reach;                                                          /* edges beyond it may be left out */
  double ax[SCAN_BLOCK], ay[SCAN_BLOCK], bx[SCAN_BLOCK], by[SCAN_BLOCK]; /* both ends */
} scan_edges;

/* Lets the fan see the edges, and forgets them. */
void scan_see(scan_fan *self, scan_edges *edges);

/* A circle around (dx, dy) from the sensor, in the frame of `edges`. */
void scan_see_circle(scan_fan *self, double dx, double dy, double radius, const scan_edges *edges);

/* Distance beyond which nothing can come first in any beam any more. */
double scan_farthest(const scan_fan *self);

/* From reciprocals to distances: -1 where nothing is nearer than 1 / `nothing`. Forgets the reciprocals. */
void scan_distances(scan_fan *self, double nothing, double *distances);

struct scan_fan {
  size_t count;
  double turn_cosine, turn_sine; /* from the sensor's x axis to the fan's middle */
  double half;                   /* of the angle that the fan covers */
  double per_radian;             /* beams */
  double margin;                 /* beams */
  double *cosine, *sine;         /* of each beam, from the fan's middle */
  double *inverse;               /* 1 / distance found so far; 0 before a scan */
  double values[];
};

/* Beam numbers from the smallest >= low to the largest <= high that the fan has. */
static inline void scan_beams_within(const scan_fan *self, double low, double high, long *first, long *last) {
  const double most = (double)(self->count - 1);
  *first = low <= 0.0 ? 0 : (low > most ? (long)self->count : (long)low + ((double)(long)low < low));
  *last = high >= most ? (long)self->count - 1 : (high < 0.0 ? -1 : (long)high);
}

static inline void scan_keep(scan_fan *self, long i, double distance) {
  const double inverse = 1.0 / distance;
  if (inverse > self->inverse[i]) self->inverse[i] = inverse;
}

#endif
