/* encoder.h: an optical wheel encoder, with one channel or with two in quadrature.
 *
 * Each world step turns the wheel from one angle to the next; the edges in between are put on the pins at the cycles that
 * linear interpolation gives. `edges_per_turn` counts both edges of all channels. With two channels A leads B when the
 * wheel turns forward: (A, B) = 00, 10, 11, 01. A sensor too near or too far from its disc sees edges that are none, and
 * misses some (section 7 of the hardware's fact sheet); one whose output has no hysteresis bounces at each edge.
 * Faults: missing, a share of the edges; extra, a flicker after a share of them; noisy, a square wave of that many Hz at A in
 * the place of its edges.
 */
#ifndef PART_ENCODER_H
#define PART_ENCODER_H

#include "../world/sensors/wheel_encoder.h"
#include "part.h"

/* python: begin */
typedef struct {
  uint32_t edges_per_turn;
  double missed;    /* probability that an edge of a channel is not seen; the next one then changes nothing; 0: never */
  double extra;     /* probability that a channel flickers after an edge: two more edges; 0: never */
  double flicker_s; /* how long such a flicker lasts, on average */
  double
      bounces; /* after each edge a channel goes back and forth, from 0 to this many times, all equally often; 0: never */
  double bounce_s; /* from one of these edges to the next, on average */
} encoder_parameters;
/* python: end */

typedef struct {
  part part;
  int side; /* 0 left, 1 right */
  encoder_parameters parameters;
  double edges_per_rad;
  double phase;    /* edges: where the disc stands at angle 0, in [0, 1) */
  double position; /* edges, at the end of the last step */
  long long index; /* its whole part */
  long long first; /* and at power-on */
  uint64_t waved;  /* a fault's square wave is on the pin up to this cycle */
} encoder;

/* python: begin */
/* At a wheel. Shows the edges that passed it, forward less backward. Parameters: encoder_parameters. Pins: channels A and B, or PART_NO_PIN. */
extern const part_kind encoder_kind;
/* python: end */

#endif
