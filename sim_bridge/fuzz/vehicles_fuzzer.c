/* vehicles_fuzzer.c: libFuzzer drives worlds without boards: it builds an arena out of any numbers, places vehicles, steps
 * them, and saves, spoils and restores their states. After every action all
 * that a world shows is a finite number, and what was refused has changed nothing. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

#define WORLDS 2
#define STEPS 64 /* of an action */

#define CHECK(condition)                                              \
  do {                                                                \
    if (!(condition)) {                                               \
      fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      abort();                                                        \
    }                                                                 \
  } while (0)

/* ---- what the input says ------------------------------------------------------------------------------------------ */

typedef struct {
  const uint8_t *at, *end;
} input;

static uint8_t byte(input *in) { return in->at < in->end ? *in->at++ : 0; }

/* A number of the kinds that hurt: ordinary, special, or any bits. */
static double number(input *in) {
  static const double special[] = {NAN, INFINITY, -INFINITY, 0.0, -0.0, 1e300, -1e300, 1e-320, 1e6, -1e6, 1e9, 1e-9};
  const uint8_t kind = byte(in);
  if (kind < 180) return ((double)kind - 90.0) / 30.0;
  if (kind < 240) return special[kind % (sizeof special / sizeof *special)];
  uint64_t bits = 0;
  for (int i = 0; i < 8; i++) bits = bits << 8 | byte(in);
  double any;
  memcpy(&any, &bits, sizeof any);
  return any;
}

/* ---- what it is done to ------------------------------------------------------------------------------------------- */

/* Of an arena, whose numbers its description checks. */
static double position(input *in) { return ((double)byte(in) - 128.0) / 30.0; }
static double size(input *in) { return ((double)byte(in) + 1.0) / 100.0; }

static void add_shapes(arena *where, input *in) {
  double xy[10];
  path_waypoint way[3];
  for (uint8_t shapes = byte(in) % 6; shapes > 0; shapes--) {
    const size_t count = 3 + byte(in) % 3;
    for (size_t i = 0; i < 2 * count; i++) xy[i] = position(in);
    const int is_polygon = arena_repeated(xy, count, 1) < 0;
    const arena_surface surface = {.height = size(in), .infrared_reflectance = 0.5, .sound_reflectance = 1.0};
    const arena_surface *s = byte(in) % 2 ? &surface : NULL;
    switch (byte(in) % 6) {
      case 0:
        if (is_polygon) (void)arena_add_edges(where, xy, count, byte(in) % 3, s);
        break;
      case 1:
        (void)arena_add_disc(where, position(in), position(in), size(in), s);
        break;
      case 2:
        (void)arena_add_patch(where, xy, count, size(in));
        break;
      case 3:
        (void)arena_add_light(where, position(in), position(in), size(in), size(in));
        break;
      case 4:
        arena_set_charger(where, position(in), position(in), size(in));
        break;
      default:
        for (size_t i = 0; i < 3; i++) way[i] = (path_waypoint){(double)i, position(in), position(in), position(in)};
        (void)arena_add_moving(where, byte(in) % 2 && is_polygon ? xy : NULL, count, size(in), s, way, 1 + byte(in) % 3,
                               byte(in) % 3);
    }
  }
  arena_build(where);
}

static arena *room(input *in) {
  static const double walls[] = {-1.8, -1.8, 1.8, -1.8, 1.8, 1.8, -1.8, 1.8};
  arena *where = arena_new();
  if (byte(in) % 2) arena_add_edges(where, walls, 4, ARENA_OUTLINE, NULL);
  add_shapes(where, in);
  return where;
}

static vehicle_model *model(void) {
  const body_parameters chassis = {.mass = 3.0,
                                   .inertia = 0.2,
                                   .radius = 0.2,
                                   .half_track = 0.2,
                                   .wheel_radius = 0.1,
                                   .linear_damping = 1.0,
                                   .angular_damping = 0.1,
                                   .grip = 0.7};
  const beam_parameters look = {.x = 0.2, .opening = 0.5, .height = 0.06, .rays = 3};
  const infrared_proximity_parameters eye = {.beam = look, .range = 1.0, .c1 = 0.03, .c2 = 0.1, .sigma = 0.01};
  const sharp_infrared_parameters sharp = {.beam = look, .reach = 1.5, .gain = 1.0, .period = 0.04, .sigma = 0.01};
  const laser_parameters finder = {.first = 1.0, .step = 0.25, .rays = 9, .range = 4.0, .sigma = 0.01};
  const phototransistor_parameters light = {.near_distance = 0.05, .gain = 1.0, .sigma = 0.01};
  const odometer_parameters wheels = {
      .half_track = 0.2, .wheel_radius = 0.1, .factor_left = 1.0, .factor_right = 1.0, .sigma_step = 1e-4};
  const accelerometer_parameters spring = {1e-3, 10.0, 0.1, 20.0, 0.05, 0.1};
  const touch_parameters whisker = {0.2, 0.0, 0.3, 0.0};
  const charge_parameters gauge = {.empty = 5.0, .full = 7.75, .sigma = 0.005};
  const energy_parameters energy = {0.002, 0.004, 0.1};
  const motor_dc_parameters motor = {0.0333, 0.0333, 0.62, 0.2e-3, 0.008, 0.02, 2.0, 1.0, 1.0, 12.0};
  vehicle_model *made = vehicle_model_new(&chassis, 0.01);
  vehicle_model_drive_dc(made, &motor, &motor, 1);
  int bad = vehicle_model_add(made, &infrared_proximity_sensor, &eye, 0.0) < 0;
  bad |= vehicle_model_add(made, &infrared_proximity_sensor, &eye, 0.03) < 0;
  bad |= vehicle_model_add(made, &sharp_infrared_sensor, &sharp, 0.0) < 0 ||
         vehicle_model_add(made, &laser_sensor, &finder, 0.1) < 0;
  bad |= vehicle_model_add(made, &phototransistor_sensor, &light, 0.0) < 0 ||
         vehicle_model_add(made, &odometer_sensor, &wheels, 0.0) < 0;
  bad |= vehicle_model_add(made, &accelerometer_sensor, &spring, 0.0) < 0 ||
         vehicle_model_add(made, &touch_sensor, &whisker, 0.0) < 0;
  vehicle_model_battery(made, &energy);
  bad |= vehicle_model_add(made, &charge_sensor, &gauge, 0.0) < 0;
  made->ends_at_collision = 0;
  CHECK(!bad);
  return made;
}

/* ---- what has to hold --------------------------------------------------------------------------------------------- */

static int placed(const vehicles *all, size_t i) { return all->worlds[i].in != NULL; }

static void check_world(vehicles *all, size_t i) {
  const vehicle *w = &all->worlds[i];
  const body_state *b = &w->body.state;
  CHECK(isfinite(b->x) && isfinite(b->y) && isfinite(b->heading));
  CHECK(w->state.flag >= VEHICLE_RUNS && w->state.flag <= VEHICLE_BRAIN_FAILED);
  const size_t count = all->model->readings;
  for (size_t k = 0; k < count; k++) CHECK(isfinite(all->readings[i * count + k]));
}

static double bounded(input *in, double most) { return fmax(fmin(number(in), most), -most); }

static void act(vehicles *all, const arena *where, input *in) {
  const uint8_t action = byte(in);
  const size_t i = action / 8 % WORLDS;
  const double signals[2] = {number(in), number(in)};
  switch (action % 8) {
    case 0:
      (void)vehicles_place(all, i, where, byte(in), 1u + byte(in), bounded(in, ARENA_FARTHEST_M),
                           bounded(in, ARENA_FARTHEST_M), bounded(in, BODY_HEADING_LIMIT));
      break;
    case 1:
      if (placed(all, i)) vehicles_set_speeds(all, i, bounded(in, 99.9), bounded(in, 999.9));
      break;
    case 2:
      (void)vehicles_hash(all, i);
      break;
    case 3:
      if (placed(all, i)) (void)vehicles_run(all, i, 1, vehicle_wander, byte(in) % STEPS);
      break;
    case 4:
      (void)arena_ray(where, signals[0], signals[1], 1.0, 0.0, number(in), number(in), NULL);
      CHECK(!isnan(arena_clearance(where, signals[0], signals[1], 5.0)));
      break;
    default:
      if (placed(all, i) && isfinite(signals[0] + signals[1])) vehicles_step(all, i, 1, signals, byte(in) % STEPS);
  }
  for (size_t k = 0; k < WORLDS; k++) {
    if (placed(all, k)) check_world(all, k);
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  input in = {data, data + size};
  arena *where = room(&in);
  vehicle_model *made = model();
  vehicles *all = vehicles_new(made, WORLDS, sizeof(vehicle_wander_state));
  for (size_t i = 0; i < WORLDS; i++) (void)vehicles_place(all, i, where, i, 1 + (uint32_t)i, 0.0, 0.0, 0.3);
  while (in.at < in.end) act(all, where, &in);
  vehicles_destroy(all);
  vehicle_model_destroy(made);
  arena_destroy(where);
  return 0;
}
