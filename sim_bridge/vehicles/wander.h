/* wander.h: the notes' wandering (listing 5.2) with a turn away from what an IR proximity sensor sees, as a brain in
 * compiled code: what sweeps run and what the bench measures. */
#ifndef VEHICLES_WANDER_H
#define VEHICLES_WANDER_H

#include <stdint.h>

/* python: begin */
/* Its memory; zero at first. `seed` differs between worlds. Readings 0 and 1 must be the IR sensors, left and right. */
typedef struct {
  uint64_t seed, draws;
  int32_t state; /* 0 start forward, 1 forward, 2 turning */
  int32_t right; /* 1: turns to the right */
} vehicle_wander_state;

void vehicle_wander(void *state, const double *readings, double *signals);
/* python: end */

#endif
