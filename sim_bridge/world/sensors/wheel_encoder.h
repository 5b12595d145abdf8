/* wheel_encoder.h: a slotted disc on a wheel, of which a sensor sees edges: which edges come in a step of the world, and what a
 * board's firmware reports of them.
 *
 * Edges have numbers along the wheel's way: the disc stands `phase` edges behind edge 0 when the wheel's angle is 0. Within
 * a step they come at the times that linear interpolation gives. The report is the count and the time between the last two,
 * by stamps of 16 us, as firmware/src/encoder.c makes it.
 */
#ifndef SENSORS_WHEEL_ENCODER_H
#define SENSORS_WHEEL_ENCODER_H

#include "sensor.h"

/* The disc moves from `before` to `after` (edges) in a step and has passed all edges up to `*index`. Passes the next one:
 * returns 1 forward, -1 backward, and at which `share` of the step it comes; 0: none is left. */
int wheel_encoder_pass(double before, double after, long long *index, double *share);

/* python: begin */
typedef struct {
  double edges_per_turn; /* both edges of all channels */
  double missed;         /* probability that an edge is not seen; the next one then changes nothing; 0: never */
  int right;             /* 1: of the right wheel */
  int directed;          /* 1: two channels, it knows backward from forward; 0: its count only grows */
} wheel_encoder_parameters;

/* Readings: edges counted; time between the last two, 16 us, 0: none within 0.5 s. */
extern const sensor_kind wheel_encoder_sensor;
/* python: end */

#endif
