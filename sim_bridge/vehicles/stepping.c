/* stepping.c: worlds make their steps, alone or in rows, by signals that hold or by a brain; see vehicle.h. */
#include <math.h>

#include "vehicle.h"
#include "vehicle_row.h"

/* From motor signals that were sent to the next readings. */
static void finish_step(vehicles *self, size_t i) { world_step(&self->worlds[i].own); }

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
  if (self->worlds[i].state.flag == VEHICLE_RUNS) finish_step(self, i);
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
    finish_step(self, i);
  }
  return VEHICLE_OK;
}

/* Steps of ROW worlds that run, side by side until a run ends. */
static int run_row(vehicles *self, const size_t row[], vehicle_brain *brain, size_t steps) {
  int status = VEHICLE_OK;
  int all_run = 1;
  size_t left = steps;
  for (; left > 0 && all_run; left--) {
    for (size_t k = 0; k < ROW; k++) {
      const int sent = command(self, row[k], brain);
      if (sent != VEHICLE_OK) status = sent;
      all_run &= sent == VEHICLE_OK;
    }
    if (all_run) vehicle_row_step(self, row);
    for (size_t k = 0; k < ROW; k++) {
      if (!all_run && runs(self, row[k])) finish_step(self, row[k]);
    }
    for (size_t k = 0; k < ROW; k++) all_run &= runs(self, row[k]);
  }
  for (size_t k = 0; k < ROW && left > 0; k++) {
    const int ran = run_alone(self, row[k], brain, left);
    if (ran != VEHICLE_OK) status = ran;
  }
  return status;
}

/* Worlds that run are put into rows; the last few go alone. */
static int run_all(vehicles *self, size_t first, size_t count, vehicle_brain *brain, size_t steps) {
  int status = VEHICLE_OK;
  size_t row[ROW];
  size_t waiting = 0;
  for (size_t i = first; i < first + count; i++) {
    if (runs(self, i)) row[waiting++] = i;
    if (waiting < ROW) continue;
    const int ran = run_row(self, row, brain, steps);
    if (ran != VEHICLE_OK) status = ran;
    waiting = 0;
  }
  for (size_t k = 0; k < waiting; k++) {
    const int ran = run_alone(self, row[k], brain, steps);
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
