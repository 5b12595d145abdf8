/* wander.c: see wander.h. */
#include "wander.h"

#include "../world/noise.h"

#define FORWARD 0.5
#define TURN 0.7
#define TURN_PROBABILITY 0.01
#define STOP_TURN_PROBABILITY 0.03
#define NEAR 0.25 /* IR reading at which it turns away (chosen: 0.45 m) */

static double draw(vehicle_wander_state *s) { return noise_unit(hash_mix(hash_mix(s->seed) ^ s->draws++)); }

void vehicle_wander(void *state, const double *readings, double *signals) {
  vehicle_wander_state *s = state;
  const double left = readings[0];
  const double right = readings[1];
  const int close = left > NEAR || right > NEAR;
  if (s->state != 2 && (close || (s->state == 1 && draw(s) < TURN_PROBABILITY))) {
    s->right = close ? left > right : draw(s) >= 0.5;
    s->state = 2;
  } else if (s->state == 0) {
    s->state = 1;
  } else if (s->state == 2 && !close && draw(s) < STOP_TURN_PROBABILITY) {
    s->state = 0;
  }
  const double turn = s->state == 2 ? (s->right ? TURN : -TURN) : FORWARD;
  signals[0] = turn;
  signals[1] = s->state == 2 ? -turn : FORWARD;
}
