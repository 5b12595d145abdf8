/* ground.c: see ground.h. */
#include "ground.h"

#include <math.h>

#define LIMIT_LEAST 1e-30 /* N s: less is none */
#define HELD 1e-9         /* m/s: slower than this a tyre that is within its limit holds */

static int is_blocked(const body *of, int wheel) { return of->faults.any && of->faults.blocked[wheel]; }

void ground_begin(ground *self, body *of, const double limits[2], double torque_left, double torque_right, double dt) {
  body_state *s = &of->state;
  const double half = of->parameters.half_track;
  *self = (ground){.limit = {limits[0] * dt, limits[1] * dt}};
  if (!s->slipping) {
    s->rim_left = body_left_speed(of);
    s->rim_right = body_right_speed(of);
    s->slipping = 1;
  }
  s->rim_left += dt * torque_left * of->per_radius / of->slip_spin;
  s->rim_right += dt * torque_right * of->per_radius / of->slip_spin;
  if (is_blocked(of, 0)) s->rim_left = 0.0;
  if (is_blocked(of, 1)) s->rim_right = 0.0;
  /* alpha and beta of (2.31), (2.32) as the force and the moment that they are for rolling wheels */
  const double drag = dt * of->drag * (of->mass + 2.0 * of->spin) / of->mass;
  const double turn_drag = dt * of->turn_drag * (of->inertia + 2.0 * half * half * of->spin) / of->inertia;
  s->speed -= (drag < 1.0 ? drag : 1.0) * s->speed;
  s->turn_rate -= (turn_drag < 1.0 ? turn_drag : 1.0) * s->turn_rate;
}

/* The impulse (px, py), |p| <= limit, that leaves the least of s p + p K p / 2 with K = diag(kx, ky): it stops the slip
 * s, or lies against what is left of it. The multiplier m of p = -s / (m + K) is found by Newton's method on 1 / |p|,
 * which is concave: from m = 0 it converges from one side. */
static void floor_impulse(double sx, double sy, double kx, double ky, double limit, double *px, double *py) {
  double m = 0.0;
  *px = *py = 0.0;
  if (!(limit > LIMIT_LEAST)) return;
  for (int round = 0; round < 40; round++) {
    const double x = sx / (m + kx);
    const double y = sy / (m + ky);
    const double squared = x * x + y * y;
    *px = -x;
    *py = -y;
    if (squared <= limit * limit * (1.0 + 1e-14)) return;
    const double length = sqrt(squared);
    const double slope = (x * x / (m + kx) + y * y / (m + ky)) / (squared * length);
    m += (1.0 / limit - 1.0 / length) / slope;
  }
}

/* Both wheels answer the same speeds, so that left and right are treated alike; each by more than its own inverse mass,
 * so that together they do not answer too much. */
double ground_round(ground *self, body *of) {
  body_state *s = &of->state;
  const double half = of->parameters.half_track;
  const double straight = 1.0 / of->mass;
  const double turning = half * half / of->inertia;
  const double spinning = 1.0 / of->slip_spin;
  const double ky = 2.0 * straight;
  const double slip[2] = {body_left_speed(of) - s->rim_left, body_right_speed(of) - s->rim_right};
  double along[2];
  double across[2];
  double most = 0.0; /* of the speeds along */
  for (int i = 0; i < 2; i++) {
    const double kx = straight + turning + (is_blocked(of, i) ? 0.0 : spinning) + fabs(straight - turning);
    double x, y;
    floor_impulse(slip[i] - kx * self->along[i], s->lateral - ky * self->across[i], kx, ky, self->limit[i], &x, &y);
    along[i] = x - self->along[i];
    across[i] = y - self->across[i];
    self->along[i] = x;
    self->across[i] = y;
    most = fmax(most, kx * fabs(along[i]));
  }
  s->speed += (along[0] + along[1]) / of->mass;
  s->turn_rate += half * (along[1] - along[0]) / of->inertia;
  if (!is_blocked(of, 0)) s->rim_left -= along[0] / of->slip_spin;
  if (!is_blocked(of, 1)) s->rim_right -= along[1] / of->slip_spin;
  s->lateral += (across[0] + across[1]) / of->mass;
  return most + ky * fmax(fabs(across[0]), fabs(across[1]));
}

void ground_end(const ground *self, body *of, double dt) {
  body_state *s = &of->state;
  if (is_blocked(of, 0) || is_blocked(of, 1)) return;
  const double centripetal =
      0.5 * of->mass * fabs(s->speed * s->turn_rate) * dt; /* what going round needs, half a wheel */
  for (int i = 0; i < 2; i++) {
    const double across = fmax(fabs(self->across[i]), centripetal);
    if (!(self->along[i] * self->along[i] + across * across < self->limit[i] * self->limit[i])) return;
  }
  if (fabs(body_left_speed(of) - s->rim_left) > HELD || fabs(body_right_speed(of) - s->rim_right) > HELD) return;
  if (fabs(s->lateral) > HELD) return;
  s->lateral = 0.0;
  s->slipping = 0;
}
