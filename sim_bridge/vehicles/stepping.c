/* stepping.c: worlds make their steps, by signals that hold or by a brain; see vehicle.h. */
#include <math.h>

#include "vehicle.h"

static int ready(const vehicles *self, size_t first, size_t count) {
  if (first > self->count || count > self->count - first) return 0;
  for (size_t i = first; i < first + count; i++) {
    if (self->worlds[i].in == NULL) return 0;
  }
  return 1;
}

int vehicles_step_one(vehicles *self, size_t i, double left, double right) {
  if (i >= self->count || self->worlds[i].in == NULL) return VEHICLE_NOT_PLACED;
  const int status = vehicles_send(self, i, left, right);
  if (status != VEHICLE_OK) return status;
  if (self->worlds[i].state.flag == VEHICLE_RUNS) world_step(&self->worlds[i].own);
  return self->worlds[i].state.flag;
}

/* Motor signals of a world's next step: from its brain; without one they hold. Returns VEHICLE_OK, or that the run of a
 * world whose brain failed has ended. */
static int command(vehicles *self, size_t i, vehicle_brain *brain) {
  if (brain == NULL) return VEHICLE_OK;
  double signals[2] = {0.0, 0.0};
  brain(self->brains + i * self->state_size, &self->readings[i * self->model->readings], signals);
  const int sent = vehicles_send(self, i, signals[0], signals[1]);
  if (sent != VEHICLE_OK) self->worlds[i].state.flag = VEHICLE_BRAIN_FAILED;
  return sent;
}

static int runs(const vehicles *self, size_t i) { return self->worlds[i].state.flag == VEHICLE_RUNS; }

/* Steps of one world until its run ends. */
static int run_alone(vehicles *self, size_t i, vehicle_brain *brain, size_t steps) {
  for (size_t step = 0; step < steps && runs(self, i); step++) {
    const int sent = command(self, i, brain);
    if (sent != VEHICLE_OK) return sent;
    world_step(&self->worlds[i].own);
  }
  return VEHICLE_OK;
}

/* The same of several, one after the other. */
static int run_all(vehicles *self, size_t first, size_t count, vehicle_brain *brain, size_t steps) {
  int status = VEHICLE_OK;
  for (size_t i = first; i < first + count; i++) {
    const int ran = run_alone(self, i, brain, steps);
    if (ran != VEHICLE_OK) status = ran;
  }
  return status;
}

int vehicles_step(vehicles *self, size_t first, size_t count, const double *signals, size_t steps) {
  if (!ready(self, first, count)) return VEHICLE_NOT_PLACED;
  for (size_t i = 0; i < 2 * count; i++) {
    if (!isfinite(signals[i])) return VEHICLE_BAD_NUMBER;
  }
  for (size_t k = 0; k < count; k++) (void)vehicles_send(self, first + k, signals[2 * k], signals[2 * k + 1]);
  return run_all(self, first, count, NULL, steps);
}

int vehicles_run(vehicles *self, size_t first, size_t count, vehicle_brain *brain, size_t steps) {
  return ready(self, first, count) ? run_all(self, first, count, brain, steps) : VEHICLE_NOT_PLACED;
}
