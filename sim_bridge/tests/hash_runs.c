/* hash_runs.c: runs worlds of every sensor and both drives and prints a hash of each. The test compiles it with several
 * compilers and options: the hashes are the same. Its arguments are the body of the notes' robot, as vehicle.py has it:
 * mass, inertia, radius, half track, wheel radius, linear and angular damping, grip. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "../vehicles/vehicle.h"
#include "../vehicles/wander.h"
#include "../world/sensors/accelerometer.h"
#include "../world/sensors/charge.h"
#include "../world/sensors/compass.h"
#include "../world/sensors/infrared_proximity.h"
#include "../world/sensors/laser.h"
#include "../world/sensors/light.h"
#include "../world/sensors/odometer.h"
#include "../world/sensors/sharp_infrared.h"
#include "../world/sensors/sonar.h"
#include "../world/sensors/touch.h"

#define WORLDS 9
#define STEPS 600
#define BODY 8

static arena *room(void) {
  static const double outline[] = {-1.8, -1.8, 1.8, -1.8, 1.8, 1.8, -1.8, 1.8};
  static const double pillar[] = {-0.9, 0.7, -0.7, 0.7, -0.7, 0.9, -0.9, 0.9};
  static const path_waypoint there_and_back[] = {{0.0, 1.0, -1.2, 0.0}, {4.0, 1.0, 1.2, 3.0}};
  arena *where = arena_new();
  arena_add_edges(where, outline, 4, ARENA_OUTLINE, NULL);
  arena_add_edges(where, pillar, 4, ARENA_OBSTACLE, NULL);
  arena_add_disc(where, 0.8, -0.8, 0.15, NULL);
  arena_add_light(where, 1.5, 1.5, 0.3, 2.0);
  arena_add_moving(where, NULL, 0, 0.1, NULL, there_and_back, 2, PATH_BACK_AND_FORTH);
  arena_build(where);
  return where;
}

static int add_sensors(vehicle_model *m) {
  const beam_parameters look = {.x = 0.1, .heading = 0.4, .opening = 0.5, .height = 0.06, .rays = 3};
  beam_parameters right = look;
  right.heading = -0.4;
  int bad = 0;
  for (int side = 0; side < 2; side++) {
    const infrared_proximity_parameters ir = {
        .beam = side ? right : look, .range = 1.0, .c1 = 0.03, .c2 = 0.1, .sigma = 0.01};
    bad |= vehicle_model_add(m, &infrared_proximity_sensor, &ir, 0.0) < 0;
  }
  bad |= vehicle_model_add(m, &sonar_sensor,
                           &(sonar_parameters){.beam = look,
                                               .range_minimum = 0.02,
                                               .range_maximum = 3.0,
                                               .sigma = 0.01,
                                               .miss = 0.02,
                                               .grazing_cosine = 0.7},
                           0.05) < 0;
  bad |=
      vehicle_model_add(m, &sharp_infrared_sensor,
                        &(sharp_infrared_parameters){
                            .beam = look, .reach = 1.5, .sigma = 0.01, .gain = 1.0, .period = 0.0383, .late = 0.0076},
                        0.0) < 0;
  bad |= vehicle_model_add(m, &laser_sensor,
                           &(laser_parameters){.first = -2.0, .step = 0.05, .rays = 80, .range = 4.0, .sigma = 0.01},
                           0.1) < 0;
  bad |= vehicle_model_add(m, &compass_sensor, &(compass_parameters){.sigma = 0.05, .iron_x = 0.1, .current_y = 0.01},
                           0.0) < 0;
  bad |= vehicle_model_add(m, &accelerometer_sensor, &(accelerometer_parameters){1e-3, 10.0, 0.1, 20.0, 0.05, 0.1},
                           0.0) < 0;
  bad |= vehicle_model_add(
             m, &phototransistor_sensor,
             &(phototransistor_parameters){.near_distance = 0.05, .gain = 1.0, .sigma = 0.01, .height = 0.09}, 0.0) < 0;
  bad |= vehicle_model_add(m, &odometer_sensor,
                           &(odometer_parameters){.half_track = 0.05,
                                                  .wheel_radius = 0.033,
                                                  .factor_left = 1.01,
                                                  .factor_right = 0.99,
                                                  .sigma_share = 0.01,
                                                  .edges_per_turn = 64.0,
                                                  .slips_per_s = 0.1,
                                                  .slip_share = 1.0},
                           0.0) < 0;
  /* As the notes have them: what a row reads at once. */
  bad |= vehicle_model_add(m, &compass_sensor, &(compass_parameters){.sigma = 0.05, .bias = 0.2}, 0.0) < 0;
  bad |=
      vehicle_model_add(
          m, &odometer_sensor,
          &(odometer_parameters){
              .half_track = 0.05, .wheel_radius = 0.033, .factor_left = 1.01, .factor_right = 0.99, .sigma_step = 1e-4},
          0.0) < 0;
  bad |= vehicle_model_add(m, &touch_sensor, &(touch_parameters){0.05, 0.03, 0.12, 0.06}, 0.0) < 0;
  return bad;
}

static vehicle_model *model(int servos, const double notes[BODY]) {
  const body_parameters small = {.mass = 0.6,
                                 .inertia = 1.2e-3,
                                 .radius = 0.07,
                                 .half_track = 0.0525,
                                 .wheel_radius = 0.0331,
                                 .wheel_mass = 0.03,
                                 .wheel_inertia = 1.7e-5,
                                 .linear_damping = 1.0,
                                 .angular_damping = 0.004,
                                 .grip = 0.7,
                                 .slip = servos};
  const body_parameters large = {.mass = notes[0],
                                 .inertia = notes[1],
                                 .radius = notes[2],
                                 .half_track = notes[3],
                                 .wheel_radius = notes[4],
                                 .linear_damping = notes[5],
                                 .angular_damping = notes[6],
                                 .grip = notes[7]};
  servo_motor_parameters left = {
      .mount = 1.0,
      .wheel_radius = 0.0331,
      .centre_us = 1502.0,
      .dead_band_us = 9.0,
      .top_ccw_rad_s = 5.4,
      .scale_ccw_us = 78.5,
      .top_cw_rad_s = 5.2,
      .scale_cw_us = 75.0,
      .lag_s = 0.055,
      .motor = {.gain_n_s = 1.2, .torque_maximum_n_m = 0.268, .coast_n_s = 0.3, .coast_maximum_n_m = 0.05}};
  servo_motor_parameters right = left;
  right.mount = -1.0;
  vehicle_model *m = vehicle_model_new(servos ? &small : &large, servos ? 0.001 : 0.01);
  const motor_dc_parameters dc = {0.0333, 0.0333, 0.62, 0.2e-3, 0.008, 0.02, 2.0, 1.0, 1.0, 12.0};
  if (servos) {
    vehicle_model_drive_servo(m, &left, &right);
  } else {
    vehicle_model_drive_dc(m, &dc, &dc, 1);
  }
  const charge_parameters gauge = {.empty = 5.0, .full = 7.75, .sigma = 0.005};
  const energy_parameters energy = {0.002, 0.004, 0.1};
  vehicle_model_battery(m, &energy);
  const int bad = add_sensors(m) || vehicle_model_add(m, &charge_sensor, &gauge, 0.0) < 0;
  m->ends_at_collision = 0;
  if (bad) printf("bad model\n");
  return m;
}

int main(int count, char **arguments) {
  double notes[BODY];
  if (count != BODY + 1) return 2;
  for (int i = 0; i < BODY; i++) notes[i] = strtod(arguments[i + 1], NULL);
  arena *where = room();
  for (int servos = 0; servos < 2; servos++) {
    vehicle_model *m = model(servos, notes);
    vehicles *worlds = vehicles_new(m, WORLDS, sizeof(vehicle_wander_state));
    for (size_t i = 0; i < WORLDS; i++) {
      if (vehicles_place(worlds, i, where, 100 + i, (uint32_t)i + 1, -0.5 + 0.1 * (double)i, 0.0, (double)i))
        printf("not placed\n");
      ((vehicle_wander_state *)(void *)(worlds->brains + i * worlds->state_size))->seed = i;
    }
    if (vehicles_run(worlds, 0, WORLDS, vehicle_wander, STEPS) != VEHICLE_OK) printf("bad run\n");
    for (size_t i = 0; i < WORLDS; i++) printf("%016" PRIx64 "\n", vehicles_hash(worlds, i));
    vehicles_destroy(worlds);
    vehicle_model_destroy(m);
  }
  arena_destroy(where);
  return 0;
}
