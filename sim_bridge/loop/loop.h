/* loop.h: one simulation: an arena, robots in it, on each a board or none, everything in lockstep.
 *
 * The world leads: a step takes world and parts from t to t + dt by what the pins did until t, and parts queue their edges
 * at exact cycles of that span; then each board runs through it, and its edges go to the parts as they happen. Everything
 * is counted in cycles of the boards' 16 MHz. The simulation knows bytes, not messages.
 *
 * A robot without a board is a vehicle (vehicles/vehicle.h): its sensors read at the end of the world's step, and its
 * motor signals hold until it gets others.
 *
 * Boards, models and arena belong to the caller and must outlive the simulation.
 */
#ifndef LOOP_LOOP_H
#define LOOP_LOOP_H

#include <stddef.h>
#include <stdint.h>

#include "boards/board.h"
#include "geometry/arena.h"
#include "parts/battery.h"
#include "parts/brown_out.h"
#include "parts/logs.h"
#include "parts/part.h"
#include "vehicles/model.h"
#include "world/body.h"

/* python: begin */
enum { SIM_LEFT = 0, SIM_RIGHT = 1 };
enum { FAULTY_LEFT_WHEEL = -1, FAULTY_RIGHT_WHEEL = -2, FAULTY_ROBOT = -3 }; /* in the place of a part's number */
enum { SIM_OBSTACLES_MAXIMUM = 64 };                                         /* that move; robots: BODY_MAXIMUM */
enum {
  SIM_OK = 0,
  SIM_NO_MEMORY = -1,
  SIM_WRONG_BOARD = -2,
  SIM_BAD_ARGUMENT = -3,
  SIM_NOT_FREE = -4,  /* something is in that place: arena, obstacle on its way, robot */
  SIM_PIN_TAKEN = -5, /* another device drives that pin, or too many hear it */
  SIM_PAUSED = -6,    /* an edge has ended the run */
  SIM_RUNS = -7,      /* it runs already: a reaction to an edge cannot let time pass */
};

/* One row of the truth. */
typedef struct {
  double time;             /* s */
  double x, y, heading;    /* m, m, rad */
  double speed, turn_rate; /* m/s, rad/s */
  double left, right;      /* wheel speeds along the ground, m/s */
  double contact;          /* 1: touched something since the last row */
} sim_truth;

typedef struct sim sim;
typedef struct robot robot;

/* step_cycles: world step; record_cycles: between two rows of the truth, a multiple of it, 0: no record. NULL without
 * memory. */
sim *sim_new(arena *where, uint64_t seed, uint32_t step_cycles, uint32_t record_cycles, int noise);
void sim_destroy(sim *self);

/* Adds a robot at rest with its board (the address of a `board`). `robot` >= 0 is its number from now on, and the key of
 * its noise: a run is the same in whatever order robots are added. Returns SIM_OK or an error. */
int sim_add_robot(sim *self, int robot, uintptr_t board, const body_parameters *parameters, double x, double y,
                  double heading);

/* The same for a robot without a board; its model steps as far as the world. */
int sim_add_vehicle(sim *self, int robot, const vehicle_model *model, double x, double y, double heading);

/* The robot of that number, which stays where it is; NULL: there is none. */
robot *sim_robot(const sim *self, int number);

/* Joins a device to pins of a robot's board, as many as its kind has; `index` among those of its kind on the robot (of
 * what has a side 0 left, 1 right), and `parameters` as its kind says. Returns SIM_OK or an error. */
int robot_add_part(robot *self, const part_kind *kind, int index, const uint8_t *pins, const void *parameters);

/* What the parts from number `first` on (in the order in which they were joined, from 0) show of themselves, one after
 * another; returns how many numbers. */
int robot_read_parts(robot *self, int first, double *values);

/* The letters that the part of that number shows, up to DISPLAY_LINES lines of DISPLAY_LETTERS codes; returns how many. */
int robot_read_letters(const robot *self, int number, uint8_t *codes);

/* A person works the part of that number. Returns SIM_OK or an error: it cannot be set so. */
int robot_set_part(robot *self, int number, double value);

/* Puts a sensor on the turret at that pin: the part that drives `pin` of the board, or is measured there. The sensor's
 * place and heading are those with the turret straight ahead. */
int robot_mount(robot *self, uint8_t turret_pin, uint8_t pin);

/* The pack that everything runs on, measured at an analog channel or at none (PART_NO_PIN). */
int robot_add_battery(robot *self, uint8_t channel, const battery_parameters *parameters);

/* Runs until a cycle, or until bytes have come from a robot that is listened to and its line has been idle for two byte
 * times, or until an edge of a board ends the run (board.h): up to where all boards have run then. Returns 0, SIM_PAUSED,
 * SIM_RUNS, or 1 + the number of a robot whose board crashed. */
int sim_run_until(sim *self, uint64_t deadline);

/* Bytes have come from a robot since its `listen_from`, and its line has been idle since. When a robot is heard does not
 * depend on the other listeners. */
int robot_speaks(const robot *self);

/* Listens to a robot when `quiet` cycles from now have passed, and runs for `cycles` at most. Returns as
 * sim_run_until. */
int robot_wait(robot *self, uint64_t cycles, uint64_t quiet);

/* Bit rate of the outside's side of a robot's serial line, 500,000 unless set. */
void robot_line_rate(robot *self, uint32_t baud);

/* Bytes to a robot's board. */
void robot_send(robot *self, const uint8_t *bytes, size_t count);

uint64_t sim_hash(const sim *self); /* of the whole state of all bodies, by robot number */

/* What a person does to the things in the arena, between two steps of the world. A robot is lifted and put elsewhere: body
 * and wheels are at rest there, and touch nothing. All else is as it was: motors go on as they are told, wheels have the
 * angles that they had, so that encoders and odometers know nothing of it, and no distance is counted. Sensors look from
 * there; those of a robot without a board read again at the end of the next step. In the truth it is two rows a cycle
 * apart. A moving shape goes along its way shifted by as much, and turned in itself; the direction of the way stays.
 * SIM_NOT_FREE, and nothing has changed: something is in the circle around the robot, or a robot's circle in the shape. */
int robot_place(robot *self, double x, double y, double heading);
int sim_place_shape(sim *self, int shape, double x, double y, double heading);

/* For tests: a pin taken from its part and driven at a cycle, or at several, the earliest first; given back to it, or let go;
 * the plug of the part of a number pulled out (1) or put in again (0). Pins and levels have been checked (pins.py). */
void robot_drive(robot *self, uint64_t at, uint8_t pin, uint8_t level);
void robot_drive_edges(robot *self, uint8_t pin, const uint64_t *at, const uint8_t *levels, size_t count);
void robot_release(robot *self, uint8_t pin);
void robot_unplug(robot *self, int number, int unplugged);

/* Lays a fault (FAULT_...) on the part of that number, or on a wheel or the whole robot, for the cycles from `begin`, now at
 * the earliest, up to `end`, which is later; `value` in the unit of the device's FAULTS. Wheels and motors take up a fault
 * with a step of the world. One of a kind that the part does not have never fires. Returns its number, or an error:
 * SIM_BAD_ARGUMENT, another one of its kind acts at the same time. */
int robot_fault(robot *self, int number, int kind, double value, uint64_t begin, uint64_t end);

/* How often what went out was not what would have gone out without the fault of that number, so far. */
uint64_t robot_fault_fired(const robot *self, int number);

/* The voltage of the rail as it is now goes to all that runs on it: after a change of `held_supply`, too. */
void robot_update_supply(robot *self);
/* python: end */

#endif
