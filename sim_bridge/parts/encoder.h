/* encoder.h: an optical wheel encoder, with one channel or with two in quadrature.
 *
 * Each world step turns the wheel from one angle to the next; the edges in between are put on the pins at the cycles that
 * linear interpolation gives. `edges_per_turn` counts both edges of all channels. With two channels A leads B when the
 * wheel turns forward: (A, B) = 00, 10, 11, 01.
 */
#ifndef PART_ENCODER_H
#define PART_ENCODER_H

#include "part.h"

typedef struct {
  part part;
  int side; /* 0 left, 1 right */
  uint8_t pin_a;
  uint8_t pin_b; /* PART_NO_PIN: one channel */
  double edges_per_rad;
  double phase;    /* edges: where the disc stands at angle 0, in [0, 1) */
  double position; /* edges, at the end of the last step */
  long long index; /* its whole part */
} encoder;

/* An encoder at the wheel of `side` (0 left, 1 right); its pins get their levels for the wheel's angle now. */
void encoder_init(encoder *self, const part_place *place, int side, uint8_t pin_a, uint8_t pin_b,
                  uint32_t edges_per_turn);

#endif
