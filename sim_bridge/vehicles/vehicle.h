/* vehicle.h: worlds without boards: motor signals in, readings out.
 *
 * `vehicles` holds N worlds of one model, each with one vehicle, its own arena, seed and pose. They know nothing of each
 * other: what one does is the same whatever the others are, in whatever order and by however many threads they are
 * stepped. The order of events within a step is that of Fig. 3.1 of the notes: sense, process, send motor signals, move,
 * update the arena, check for the end. A world starts with its first sensing done, so that one call, vehicles_step,
 * goes from motor signals to the next readings.
 */
#ifndef VEHICLES_VEHICLE_H
#define VEHICLES_VEHICLE_H

#include "../world/world.h"
#include "model.h"

/* python: begin */
/* Why a run ended. */
enum { VEHICLE_RUNS = 0, VEHICLE_COLLIDED = 1, VEHICLE_EXHAUSTED = 2, VEHICLE_BRAIN_FAILED = 3 };

typedef struct vehicles vehicles;

/* A brain in compiled code. It gets the readings and writes the two motor signals, left and right, in [-1, 1]; `state` is
 * its memory, one block for each world. In numba: void(voidptr, CPointer(float64), CPointer(float64)). */
typedef void vehicle_brain(void *state, const double *readings, double *signals);

/* `count` worlds, none of them placed. `state_size`: bytes of brain's memory in each, zero at first. NULL without memory.
 * The model must outlive them. */
vehicles *vehicles_new(const vehicle_model *model, size_t count, size_t state_size);
void vehicles_destroy(vehicles *self);

/* Puts vehicle `i` at rest at a pose, which is finite, in an arena and starts its run: `seed` and `id` (not 0) are the keys of its noise.
 * The arena must outlive it. Senses for the first time. */
int vehicles_place(vehicles *self, size_t i, const arena *where, uint64_t seed, uint32_t id, double x, double y,
                   double heading);

/* Vehicle `i`, placed, goes from here on at `speed` (m/s, along its heading) and `turn_rate` (rad/s), its wheels rolling
 * without slip. */
void vehicles_set_speeds(vehicles *self, size_t i, double speed, double turn_rate);

/* Vehicle `i`, placed and not yet moved, has these servos: its own unit, in place of those of the model. */
void vehicles_set_servos(vehicles *self, size_t i, const servo_motor_parameters *left,
                         const servo_motor_parameters *right);

/* From here on the servos of vehicle `i` get no pulses and let go (1), or get them again (0). */
void vehicles_coast(vehicles *self, size_t i, int coasts);

/* `steps` steps of worlds first ... first + count - 1 with motor signals (count, 2) that hold throughout. A world whose
 * run has ended stays as it is. Signals are finite, worlds are placed. Different threads may step different worlds. */
void vehicles_step(vehicles *self, size_t first, size_t count, const double *signals, size_t steps);

/* One step of one world. Returns VEHICLE_RUNS or why the run has ended, or an error. */
int vehicles_step_one(vehicles *self, size_t i, double left, double right);

/* The same with a brain in compiled code that is asked in every step. A signal that is not a number ends that world's run
 * and is reported. What the brain needs, memory and readings, is the caller's to see to. */
int vehicles_run(vehicles *self, size_t first, size_t count, vehicle_brain *brain, size_t steps);

/* The stages of one step of one world by themselves, for a caller that looks on in between: sense, then (the brain), send, move,
 * arena, check. Together they do what vehicles_step does; sensing twice in a step changes nothing. */
void vehicles_sense(vehicles *self, size_t i);
int vehicles_send(vehicles *self, size_t i, double left, double right);
void vehicles_move(vehicles *self, size_t i);
void vehicles_update_arena(vehicles *self, size_t i);
int vehicles_check(vehicles *self, size_t i); /* VEHICLE_RUNS or why the run ended */

/* Currents of the DC motors, left and right, A: the state of the full motor, else what the last signals and the speed now
 * give; 0 with another drive. */
void vehicles_currents(const vehicles *self, size_t i, double currents[2]);

/* Of everything that a world has come to: body, drive, battery, sensors, readings, a brain's memory; the same on every
 * machine. */
uint64_t vehicles_hash(const vehicles *self, size_t i);

/* Memory of all worlds, bytes. */
size_t vehicles_memory(const vehicles *self);
/* python: end */

/* What a sensor keeps from step to step. */
typedef struct {
  uint64_t key; /* of its noise */
  sample_hold hold;
  sensor_memory memory;
  void (*free_work)(void *work); /* of the memory */
} sensor_slot;

/* What changes in a world, without pointers. */
typedef struct {
  uint64_t seed, step, sensed; /* sensed: the step after whose sensing the readings are, plus 1 */
  uint32_t id;
  int32_t flag;
  double signals[2];
  double currents[2]; /* of full DC motors, A */
  double acceleration;
  double energy;
  uint64_t next_pulse; /* step of the servos' next pulse */
  int32_t coasts;      /* they get none */
  uint64_t contacts;   /* touches begun, apart by 0.1 s at least */
  uint64_t touched;    /* the last step that touched */
  servo_motor servos[2];
} vehicle_state;

typedef struct {
  vehicles *all;
  const world *in;    /* the world that it is in; NULL: none yet */
  world own;          /* its own, if that is it: with this vehicle alone */
  world_robot member; /* of it */
  servo_motor_parameters servo[2];
  double hold;         /* of the DC motors' friction, see motor_dc.h */
  double speed_before; /* when the step under way began, m/s */
  body body;
  vehicle_state state;
} vehicle;

/* What a vehicle does in a step of the world that it is in; the owner is a `vehicle`. A vehicle whose run has ended gets no
 * signals any more. */
extern const world_robot_operations VEHICLE_OPERATIONS;

struct vehicles {
  const vehicle_model *model;
  size_t count, state_size;
  vehicle *worlds;
  size_t slots_count;
  sensor_slot *slots;    /* as many for each world as the model has sensors */
  double *numbers;       /* that the sensors keep, world by world */
  double *readings;      /* world by world */
  unsigned char *brains; /* memory of compiled ones, `state_size` bytes for each world */
};

#endif
