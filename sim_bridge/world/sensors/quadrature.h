/* quadrature.h: decoding of two detectors a quarter period apart (notes, section 1.2.2 and Fig. 1.6): steps with
 * direction, and what cannot be, both lines changing at once, is counted as illegal and moves nothing. */
#ifndef SENSORS_QUADRATURE_H
#define SENSORS_QUADRATURE_H

#include <stdint.h>

/* python: begin */
typedef struct {
  uint8_t state; /* A << 1 | B */
  int64_t count; /* forward while the new B is the old A: 00, 10, 11, 01 */
  uint64_t illegal;
} quadrature;

/* The lines are at these levels, 0 or 1, now. */
void quadrature_decode(quadrature *self, int a, int b);
/* python: end */

#endif
