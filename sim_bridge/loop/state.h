/* state.h: what the files of the loop know of a simulation: robots.c finds its robots, truth.c reads it, run.c runs it, join.c
 * builds it, vehicle.c has the robots without boards, interventions.c lays a test's hands on it. Each calls only those before
 * it.
 */
#ifndef LOOP_STATE_H
#define LOOP_STATE_H

#include "loop.h"
#include "parts/turret.h"
#include "vehicles/vehicle.h"
#include "world/world.h"

#define SIM_NEVER UINT64_MAX
#define HEARING_PARTS 7 /* at most, at one pin */

/* A moving shape's clock as the record of waits has it. */
typedef struct {
  double waited; /* s, after the last step */
  double lost;   /* s, in that step */
} mover_clock;

struct robot {
  sim *sim;
  int number;
  board *board; /* NULL: it has none, and is a vehicle */
  body *body;
  vehicles *vehicle; /* one, in this simulation's world; NULL: it has a board */
  body own;          /* of a robot with a board */
  chassis chassis;
  part **parts;
  int part_count;
  fault **faults; /* of all parts and of the robot, by their numbers */
  int fault_count;
  part *hears[BOARD_PIN_COUNT][HEARING_PARTS + 1]; /* of each pin, up to the first NULL */
  uint8_t outside[BOARD_PIN_COUNT];                /* what parts do to pins, for others that hear them; else RELEASED */
  uint8_t drives[BOARD_PIN_COUNT];                 /* role of the part that drives the pin, or 0 */
  part *analog[BOARD_ANALOG_COUNT];
  double sampled[BOARD_ANALOG_COUNT]; /* V, the converter's last ones; NAN: none yet */
  double held[BOARD_ANALOG_COUNT];    /* V that a test holds there; NAN: none */
  brown_out brown_out;
  battery *battery;   /* NULL: a supply that never sags */
  double held_supply; /* share of the nominal voltage that a test holds, or 0 */
  buffer received;
  buffer received_at; /* cycle of the end of each of them, while `is_stamped` */
  bool is_stamped;
  uint64_t last_byte;   /* cycle of the end of the last byte received */
  uint64_t listen_from; /* bytes end a run from this cycle on */
  uint64_t idle;        /* cycles without a byte after which the line is idle: two bytes' time */
  uint64_t reset_at;    /* cycle of the last reset from outside */
  buffer truth;
  edge_log edges;
  uint64_t next_row; /* least cycle of the truth's next row */
  int touched;       /* since its last row */
  uint64_t last_touch;
  uint64_t contacts; /* touches begun; apart by 0.1 s at least */
};

struct sim {
  world world;
  world_robot members[BODY_MAXIMUM]; /* of the world, by increasing number */
  mover movers[SIM_OBSTACLES_MAXIMUM + BODY_MAXIMUM];
  uint64_t seed;
  uint32_t step_cycles;
  uint32_t record_cycles;
  int noise;
  uint64_t now;      /* boards have run up to here */
  uint64_t world_at; /* world and parts have run up to here */
  bool runs;         /* somebody lets time pass */
  uint64_t next_record;
  robot **robots; /* by increasing number */
  int robot_count;
  mover_clock clocks[SIM_OBSTACLES_MAXIMUM];
  buffer waits;  /* rows of sim_wait */
  buffer shifts; /* rows of sim_shift */
};

/* ---- robots.c, which the others build on */

/* The turret on that pin, or NULL. */
turret *robot_turret(const robot *self, uint8_t pin);

/* Sensors of robots without a board begin anew, when another robot has come: they may meet another thing now. */
void sim_sense_anew(sim *self);

/* The id of a robot among the movers; never 0. */
static inline uint32_t robot_mover_id(int number) { return (uint32_t)number + 1u; }

/* Cycles without a byte after which a line of that bit rate is idle: the time of two bytes of ten bits. */
static inline uint64_t line_idle_cycles(uint32_t baud) { return 20u * (uint64_t)BOARD_CLOCK_HZ / baud; }

/* ---- truth.c */

/* A row of the truth, unless there is one of that cycle or a later one. */
void robot_record(robot *r, uint64_t cycle);

/* How long movers waited in the world's step that began at `begin`. */
void sim_record_waits(sim *self, uint64_t begin);

/* ---- run.c */

/* What a robot does in a step of the world, with a board or without. */
extern const world_robot_operations ROBOT_OPERATIONS;

/* What a part hears of a pin to which the board does `level`: a net has one level, so where the board lets go of it, what
 * another part does. */
uint8_t robot_heard(const robot *self, const part *by, uint8_t pin, uint8_t level);

/* Sinks of the board: context is the robot. */
void robot_on_edge(void *context, uint64_t cycle, uint8_t pin, uint8_t level);
void robot_on_outside(void *context, uint64_t cycle, uint8_t pin, uint8_t level);
double robot_on_analog(void *context, uint64_t cycle, uint8_t channel);

/* ---- join.c */

/* A new robot with a board or without; the caller fills in its body. NULL without memory. */
robot *sim_new_robot(sim *self, int number, board *b);

/* It stands at that pose, and is among the others from now on. */
void sim_insert(sim *self, robot *r, double x, double y, double heading);

#endif
