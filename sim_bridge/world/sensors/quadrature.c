/* quadrature.c: see quadrature.h. */
#include "quadrature.h"

#define ILLEGAL 2

void quadrature_decode(quadrature *self, int a, int b) {
  /* by (old state << 2) | new state */
  static const int8_t steps[16] = {0, -1, 1, ILLEGAL, 1, 0, ILLEGAL, -1, -1, ILLEGAL, 0, 1, ILLEGAL, 1, -1, 0};
  const unsigned next = ((a != 0 ? 2u : 0u) | (b != 0 ? 1u : 0u));
  const int step = steps[(self->state & 3u) << 2 | next];
  self->state = (uint8_t)next;
  if (step == ILLEGAL) {
    self->illegal++;
  } else {
    self->count += step;
  }
}
