/* sample_hold.c: see sample_hold.h. */
#include "sample_hold.h"

#define TOLERANCE 1e-9 /* of a period: times are sums of steps */

int sample_hold_due(const sample_hold *self, double time) { return time >= self->next - TOLERANCE * self->period; }

void sample_hold_take(sample_hold *self, double time, double value) {
  self->value = value;
  self->taken = time;
  /* On the sensor's own grid, unless it was not asked for longer than a period. */
  const double next = self->next + self->period;
  self->next = next > time ? next : time + self->period;
}
