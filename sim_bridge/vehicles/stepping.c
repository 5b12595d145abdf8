/* stepping.c: worlds make their steps, by signals that hold or by a brain; see vehicle.h. */
#include "vehicle.h"

int vehicles_step_one(vehicles *self, size_t i, double left, double right) {
  const int status = vehicles_send(self, i, left, right);
  if (status != VEHICLE_OK) return status;
  if (self->worlds[i].state.flag == VEHICLE_RUNS) world_step(&self->worlds[i].own);
  return self->worlds[i].state.flag;
}

/* Steps of one world until its run ends; its brain, if it has one, is asked before each. Returns VEHICLE_OK, or that the run
 * has ended since the brain failed. */
static int run_alone(vehicles *self, size_t i, vehicle_brain *brain, size_t steps) {
  vehicle *w = &self->worlds[i];
  for (size_t step = 0; step < steps && w->state.flag == VEHICLE_RUNS; step++) {
    if (brain != NULL) {
      double signals[2] = {0.0, 0.0};
      brain(self->brains + i * self->state_size, &self->readings[i * self->model->readings], signals);
      if (vehicles_send(self, i, signals[0], signals[1]) != VEHICLE_OK) {
        w->state.flag = VEHICLE_BRAIN_FAILED;
        return VEHICLE_BAD_NUMBER;
      }
    }
    world_step(&w->own);
  }
  return VEHICLE_OK;
}

void vehicles_step(vehicles *self, size_t first, size_t count, const double *signals, size_t steps) {
  for (size_t k = 0; k < count; k++) {
    (void)vehicles_send(self, first + k, signals[2 * k], signals[2 * k + 1]);
    run_alone(self, first + k, NULL, steps);
  }
}

int vehicles_run(vehicles *self, size_t first, size_t count, vehicle_brain *brain, size_t steps) {
  int status = VEHICLE_OK;
  for (size_t i = first; i < first + count; i++) {
    const int ran = run_alone(self, i, brain, steps);
    if (ran != VEHICLE_OK) status = ran;
  }
  return status;
}
