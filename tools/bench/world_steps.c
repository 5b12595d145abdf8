/* world_steps.c: robot-steps per second of worlds without boards with a compiled brain: `world_steps EDGES WORLDS`.
 *
 * The notes' robot (two DC motors, three IR sensors of three rays, odometer, compass, all with noise) wanders at steps of
 * 10 ms between square pillars. Prints the best of five runs, by the
 * processor's time, so that other work on the machine disturbs less. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "vehicles/vehicle.h"
#include "vehicles/wander.h"

#ifndef STEPS
#define STEPS 400000u
#endif
#define PITCH 1.0 /* m from pillar to pillar */

static double seconds(void) {
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void square(double *corners, double x, double y, double half) {
  const double c[8] = {x - half, y - half, x + half, y - half, x + half, y + half, x - half, y + half};
  for (int i = 0; i < 8; i++) corners[i] = c[i];
}

/* A square room with pillars on a grid, the middle left free: `edges` in all, a multiple of 4. */
static arena *room(int edges) {
  arena *where = arena_new();
  double corners[8];
  const int pillars = edges / 4 - 1;
  const int side = (int)ceil(sqrt(pillars + 1));
  const double first = -0.5 * PITCH * (side - 1) + (side % 2 ? 0.0 : 0.5 * PITCH);
  square(corners, side % 2 ? 0.0 : 0.5 * PITCH, side % 2 ? 0.0 : 0.5 * PITCH, 0.5 * PITCH * side);
  arena_add_polygon(where, corners, 4, ARENA_OUTLINE, NULL);
  int built = 0;
  for (int i = 0; i < side * side && built < pillars; i++) {
    const double x = first + PITCH * (i / side);
    const double y = first + PITCH * (i % side);
    if (fabs(x) < 0.5 && fabs(y) < 0.5) continue;
    square(corners, x, y, 0.06);
    arena_add_polygon(where, corners, 4, ARENA_OBSTACLE, NULL);
    built++;
  }
  arena_build(where);
  return where;
}

static vehicle_model *robot(void) {
  const body_parameters parameters = {.mass = 3.0,
                                      .inertia = 0.2,
                                      .radius = 0.2,
                                      .half_track = 0.2,
                                      .wheel_radius = 0.1,
                                      .linear_damping = 1.0,
                                      .angular_damping = 0.1,
                                      .grip = 0.7};
  const odometer_parameters wheels = {
      .half_track = 0.2, .wheel_radius = 0.1, .factor_left = 1.0, .factor_right = 1.0, .sigma_step = 1e-4};
  const compass_parameters needle = {.sigma = 0.05};
  vehicle_model *model = vehicle_model_new(&parameters, 0.01);
  motor_dc_parameters motor;
  motor_dc_default(&motor);
  int bad = vehicle_model_drive_dc(model, &motor, &motor, 0);
  for (int i = 0; i < 3; i++) {
    const double angle = i == 0 ? 0.7854 : (i == 1 ? -0.7854 : 0.0);
    const beam_parameters look = {
        .x = 0.2 * cos(angle), .y = 0.2 * sin(angle), .heading = angle, .opening = 0.5, .height = 0.06, .rays = 3};
    const infrared_proximity_parameters eye = {.beam = look, .range = 1.0, .c1 = 0.03, .c2 = 0.1, .sigma = 0.01};
    bad |= vehicle_model_add_infrared_proximity(model, &eye, 0.0) < 0;
  }
  bad |= vehicle_model_add_odometer(model, &wheels) < 0 || vehicle_model_add_compass(model, &needle, 0.0) < 0;
  vehicle_model_switch(model, 1, 0);
  if (bad) exit(2);
  return model;
}

int main(int count, char **arguments) {
  if (count != 3) return 2;
  const size_t worlds = (size_t)atoi(arguments[2]);
  const size_t steps = STEPS / worlds;
  arena *where = room(atoi(arguments[1]));
  vehicle_model *model = robot();
  vehicles *all = vehicles_new(model, worlds, sizeof(vehicle_wander_state));
  for (size_t i = 0; i < worlds; i++) {
    if (vehicles_place(all, i, where, i, 1, 0.0, 0.0, 0.7 * (double)(i % 9)) != VEHICLE_OK) return 2;
    ((vehicle_wander_state *)vehicles_brain_state(all, i))->seed = i;
  }
  double best = 1e9;
  for (int run = 0; run < 5; run++) {
    const double started = seconds();
    if (vehicles_run(all, 0, worlds, vehicle_wander, steps) != VEHICLE_OK) return 2;
    const double took = seconds() - started;
    if (took < best) best = took;
  }
  printf("%zu edges, %zu bytes per world\n%.0f\n", arena_edge_count(where), vehicles_memory(all) / worlds,
         (double)(steps * worlds) / best);
  vehicles_destroy(all);
  vehicle_model_destroy(model);
  arena_destroy(where);
  return 0;
}
