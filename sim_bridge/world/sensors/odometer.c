/* odometer.c: see odometer.h. */
#include "odometer.h"

#include <math.h>

#include "geometry/numbers.h"

#define ARSIM_STEP_S 0.01

void odometer_calibrate(odometer_state *s, double x, double y, double heading, double wheel_left, double wheel_right) {
  *s = (odometer_state){
      .x = x, .y = y, .heading = number_wrap(heading), .wheel_left = wheel_left, .wheel_right = wheel_right};
}

void odometer_advance(const odometer_parameters *p, odometer_state *s, double left, double right) {
  /* Share of the step's turn that is made before its travel is laid off. */
  const double share = p->rule == ODOMETER_MIDPOINT ? 0.5 : (p->rule == ODOMETER_EULER ? 0.0 : 1.0);
  const double travel = 0.5 * (left + right);
  const double turn = (right - left) / (2.0 * p->half_track);
  double sine, cosine;
  number_sincos(s->heading + share * turn, &sine, &cosine);
  s->x += travel * cosine;
  s->y += travel * sine;
  s->heading = number_wrap(s->heading + turn);
  s->distance += fabs(travel);
}

/* What the odometer believes one wheel has travelled. */
static double seen(const odometer_parameters *p, double angle, double factor, double dt, double *rest,
                   noise_source *noise) {
  double travel = factor * angle * p->wheel_radius;
  if (p->sigma_share > 0.0) travel *= 1.0 + p->sigma_share * noise_next_normal(noise);
  if (p->slips_per_s > 0.0 && noise->on && noise_next_uniform(noise) < p->slips_per_s * dt)
    travel *= 1.0 - p->slip_share;
  if (p->edges_per_turn > 0.0) {
    const double edge = 2.0 * NUMBERS_PI * p->wheel_radius / p->edges_per_turn;
    const double count = (*rest + travel) / edge;
    const double whole = (double)(long long)count; /* towards 0: an edge that was seen is not seen again at once */
    *rest = (count - whole) * edge;
    travel = whole * edge;
  }
  if (p->sigma_step > 0.0) {
    const double steps = dt == ARSIM_STEP_S ? 1.0 : sqrt(dt / ARSIM_STEP_S);
    travel += steps * p->sigma_step * noise_next_normal(noise);
  }
  return travel;
}

void odometer_step(const odometer_parameters *p, odometer_state *s, double wheel_left, double wheel_right, double dt,
                   noise_source *noise) {
  const double left = seen(p, wheel_left - s->wheel_left, p->factor_left, dt, &s->rest_left, noise);
  const double right = seen(p, wheel_right - s->wheel_right, p->factor_right, dt, &s->rest_right, noise);
  s->wheel_left = wheel_left;
  s->wheel_right = wheel_right;
  odometer_advance(p, s, left, right);
}

/* ---- of a robot without a board ----------------------------------------------------------------------------------- */

static void start(const void *self, sensor_memory *memory, const sensing *s) {
  const body_state *b = &s->body->state;
  odometer_calibrate((odometer_state *)memory->numbers, b->x, b->y, b->heading, b->wheel_left, b->wheel_right);
}

static void step(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise) {
  const body_state *b = &s->body->state;
  odometer_step(self, (odometer_state *)memory->numbers, b->wheel_left, b->wheel_right, s->dt, noise);
}

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  const odometer_state *state = (const odometer_state *)memory->numbers;
  readings[0] = state->x;
  readings[1] = state->y;
  readings[2] = state->heading;
}

const sensor_kind odometer_sensor = {.noise = 8,
                                     .size = sizeof(odometer_parameters),
                                     .numbers = 8,
                                     .readings = 3,
                                     .start = start,
                                     .step = step,
                                     .read = read};
