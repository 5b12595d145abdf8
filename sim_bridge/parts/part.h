/* part.h: what the parts have in common.
 *
 * A part is one device: its pins on one side, its question to the world on the other. It hears the board's output edges on
 * its pins, at their cycle, from inside the board's run, and answers by driving pins, at once or later. The world leads
 * the board by a step: what a part stamps by the world's time is stamped PART_GUARD cycles later, so that every stamp lies
 * ahead of the board; what it is asked in between it answers from the pose interpolated to that cycle.
 *
 * A kind of part is a struct that begins with a `part`, and its `part_operations`. Each part keeps the struct it is by
 * itself; the robot that carries it frees it with free().
 */
#ifndef PART_H
#define PART_H

#include <stdint.h>

#include "../boards/board.h"
#include "../world/body.h"
#include "../world/noise.h"
#include "../world/sensors/beam.h"
#include "fault.h"
#include "logs.h"

#define PART_GUARD BOARD_GUARD_CYCLES
#define PART_NO_PIN 255u
#define PART_PINS 8     /* at most, of one part */
#define PART_READINGS 4 /* at most, of one part */

/* What a part does with its pin. */
enum {
  PART_HEARS = 1,      /* `edge` is called for what the board does to it */
  PART_DRIVES = 2,     /* the part drives it */
  PART_PULLED_UP = 4,  /* a resistor pulls it up when nothing drives it */
  PART_ANALOG = 8,     /* `analog` is asked for the voltage there */
  PART_WEAK_HIGH = 16, /* high is only a resistor's pull, or a charge: what else drives the pin is stronger */
  PART_WEAK_LOW = 32,
  PART_OPENS = 64 /* nothing at all drives it where the part does not: it floats */
};

typedef struct {
  uint8_t pin; /* Arduino number, A0 is 14; PART_NO_PIN: not joined */
  uint8_t role;
} part_pin;

/* One wheel's motor in the step under way. */
typedef struct {
  double speed;   /* of the rim along the ground, m/s, when the step begins */
  double torque;  /* N m */
  int powered;    /* 1: the servo gets a signal */
  int is_bridged; /* 1: an H-bridge drives it, no servo */
} chassis_wheel;

/* What the parts of one robot share: the board and the body that carry them, and what is around. */
typedef struct {
  board *board;
  body *body;
  const scene *around; /* arena, moving obstacles, robots: also this one, as `self_id` */
  uint32_t self_id;
  uint64_t since;                  /* the world's step under way begins here */
  uint32_t step_cycles;            /* and takes that long */
  double x, y, heading;            /* pose at `since`; the body's state is that at the step's end */
  chassis_wheel wheel[2];          /* left, right */
  double supply;                   /* share of the nominal voltage, of the rail that the board runs on */
  double servo_supply;             /* and of that of the servos */
  double pack_v;                   /* at the pack's terminals, V */
  double bridges_a;                /* that the H-bridges draw from it in this step, A */
  double motors_a;                 /* that all motors drew in the step before, A */
  int at_charger;                  /* 1: the body stands at a charging station */
  fault *faults[3];                /* of the left wheel, the right one, the robot */
  uint8_t driven[BOARD_PIN_COUNT]; /* what was driven last, by pin */
} chassis;

typedef struct part part;

/* A turret on the body: what is mounted on it turns with it. */
typedef struct {
  double x, y;   /* of its axis, in the body's frame, m */
  double before; /* angle when the step under way begins, rad, counter-clockwise from straight ahead */
  double angle;  /* and when it ends */
} part_turret;

/* What a kind of part does; NULL: nothing. */
typedef struct {
  /* The board does `level` (LOW, HIGH, RELEASED, PULLED_UP) to a pin that the part hears, from `cycle` on. */
  void (*edge)(part *self, uint64_t cycle, uint8_t pin, uint8_t level);

  /* The body is about to move on from chassis->since: motors say their torque. */
  void (*before_step)(part *self);

  /* It has: the world stands at chassis->since + chassis->step_cycles. */
  void (*step)(part *self);

  /* The voltage at the part's analog pin. */
  double (*analog)(part *self, uint64_t cycle);

  /* What pages show of it, now or since they last asked: fills in up to PART_READINGS numbers, and returns how many. */
  int (*read)(part *self, double *values);

  /* What it shows in letters, line by line, as codes of its kind; returns how many lines. */
  int (*letters)(part *self, uint8_t *codes);

  /* A person works it: a button, a knob. Returns 0, or -1: it cannot be set so. */
  int (*set)(part *self, double value);

  /* The pin that a fault of its holds, and the level, if it holds one. */
  void (*hold)(const part *self, fault *f);
} part_operations;

struct part {
  const part_operations *op;
  chassis *chassis;
  noise_source noise;
  part_pin pins[PART_PINS];
  uint8_t level[PART_PINS];  /* what it does to each of them, or would if it were plugged in */
  const part_turret *turret; /* that carries it; NULL: the body does */
  int overridden;            /* 1: a test has its pins; it drives none */
  int unplugged;             /* 1: its plug is out; it neither hears nor drives */
  fault *faults;             /* NULL: none */
};

/* Where a part is joined; the loop knows it when the part is made. */
typedef struct {
  chassis *chassis;
  noise_source noise;
  int index; /* among those of its kind on the robot; of what has a side 0 left, 1 right */
} part_place;

/* A kind of part, as the loop makes one. */
typedef struct part_kind {
  size_t size;    /* of its struct */
  uint32_t noise; /* key of the first one's noise; of the others it is higher by their index */
  int pins;       /* how many it has */
  /* Makes it at those pins, with the parameters of its type. Returns 0, or -1: there is no such part. */
  int (*init)(part *self, const part_place *place, const uint8_t *pins, const void *parameters);
} part_kind;

/* Joins a new part to its pins: the first `count` of `pins`. */
void part_join(part *self, const part_operations *op, const part_place *place, const part_pin *pins, int count);

/* From cycle `at` on the part drives `pin` to LOW, HIGH, or lets go of it. Replaces what was queued from `at` on. */
void part_drive(part *self, uint64_t at, uint8_t pin, uint8_t level);

/* The same past its faults: by one of them. */
void part_put(part *self, uint64_t at, uint8_t pin, uint8_t level);

/* The part's fault of that kind that acts at `cycle`, or NULL. */
static inline fault *part_fault(const part *self, int kind, uint64_t cycle) {
  return self->faults == NULL ? NULL : fault_find(self->faults, kind, cycle);
}

/* The same of one that makes a difference there. */
static inline fault *part_fires(part *self, int kind, uint64_t cycle) {
  fault *f = part_fault(self, kind, cycle);
  if (f != NULL) f->fired++;
  return f;
}

/* Lays a fault on the part; one of a kind that it does not ask for never fires. Returns 0, or -1: another one of its kind
 * acts at the same time. */
int part_add_fault(part *self, fault *made);

/* A contact at its first pin changes that from level `before` to `level`, and bounces: it flicks back up to four times, each
 * number as likely, in steps that are on average an eighth of an exponential length (s, mean), cut at five times that. So
 * the last edge comes after half of that length on average. Without noise, or by a mean of 0: not at all. Returns how
 * often it flicks. */
int part_bounce(part *self, noise_source *noise, uint64_t at, uint8_t level, uint8_t before, double mean_s);

/* All that it does with that pin. */
static inline unsigned part_role(const part *self, uint8_t pin) {
  unsigned role = 0;
  for (int i = 0; i < PART_PINS; i++) role |= self->pins[i].pin == pin ? self->pins[i].role : 0u;
  return role;
}

/* What it does to that of its pins goes out again, from now on; nothing, if its plug is out. */
void part_show(part *self, int index);

/* A motor's torque in the step that begins, as its fault leaves it: weak. */
void part_weaken(part *self, chassis_wheel *wheel);

/* The share of the light that a fault leaves an eye at `cycle`: dirty; 1 without it. */
double part_light_left(part *self, uint64_t cycle);

/* Pulls its plug out (1) or puts it in again (0). */
void part_unplug(part *self, int unplugged);

/* Pulses at a pin that a part hears. */
typedef struct {
  uint8_t high;
  uint64_t rise; /* of the last pulse */
} part_pulse;

/* The board does `level` to the pin. 1: a pulse has ended. */
static inline int part_pulse_ends(part_pulse *self, uint64_t cycle, uint8_t level) {
  const uint8_t before = self->high;
  self->high = level == BOARD_HIGH;
  if (self->high && !before) self->rise = cycle;
  return before && !self->high;
}

/* End of the world's step under way. */
static inline uint64_t part_step_end(const part *self) { return self->chassis->since + self->chassis->step_cycles; }

/* Where the body is at that cycle, by linear interpolation within the step under way, and what is around it; for a part
 * on a turret, where a body would be that carries the part turned so. */
viewpoint part_view(const part *self, uint64_t cycle);

#endif
