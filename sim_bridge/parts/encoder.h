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
  part_place place;
  uint8_t pin_a;
  uint8_t pin_b; /* PART_NO_PIN: one channel */
  double edges_per_rad;
  double phase;    /* edges: where the disc stands at angle 0, in [0, 1) */
  double position; /* edges, at the end of the last step */
  long long index; /* its whole part */
} encoder;

/* The pins get their levels for wheel angle `angle`, rad. */
void encoder_init(encoder *self, const part_place *place, uint8_t pin_a, uint8_t pin_b, uint32_t edges_per_turn,
                  double angle);

/* The wheel turned to `angle`, rad, between `cycle` and `cycle + step_cycles`. */
void encoder_step(encoder *self, double angle, uint64_t cycle, uint32_t step_cycles);

#endif
