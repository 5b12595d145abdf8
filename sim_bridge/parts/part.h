/* part.h: what the parts have in common.
 *
 * A part is one device: its pins on one side, its question to the world on the other. It hears the board's output edges on
 * its pins, at their cycle, from inside the board's run, and answers by driving pins. The loop calls `*_step` for parts
 * that follow the world. The world leads the board by a step; what a part stamps by the world's time is stamped PART_GUARD
 * cycles later, so that every stamp lies ahead of the board.
 */
#ifndef PART_H
#define PART_H

#include <stdint.h>

#include "../boards/board.h"
#include "../world/arena.h"
#include "../world/body.h"
#include "../world/noise.h"

#define PART_GUARD BOARD_GUARD_CYCLES
#define PART_NO_PIN 255u

/* Who a part is among the keys of the noise. */
enum {
  PART_SERVO_LEFT = 1,
  PART_SERVO_RIGHT = 2,
  PART_ENCODER_LEFT = 11,
  PART_ENCODER_RIGHT = 12,
  PART_WHISKER = 21, /* and on */
  PART_INFRARED = 31,
  PART_PING = 41,
  PART_BATTERY = 51,
};

/* Where a part is joined: the board, the body that carries it and the arena around it. */
typedef struct {
  board *board;
  body *body;
  const arena *arena;
  noise_source noise;
  uint8_t *driven; /* what was driven last, by pin */
  int off;         /* 1: switched off; it neither hears nor drives */
} part_place;

static inline void part_drive(const part_place *place, uint64_t at, uint8_t pin, uint8_t level) {
  if (pin >= BOARD_PIN_COUNT || place->off) return;
  place->driven[pin] = level;
  place->board->op->drive(place->board, at, pin, level);
}

/* Where something looks from, in the body's frame. */
typedef struct {
  double x, y;    /* m */
  double heading; /* rad */
  double beam;    /* full opening, rad */
} part_mount;

/* The nearest edge within `reach` among `rays` rays spread over the beam, (3.9)-(3.11), or -1. Surfaces met flatter than
 * `grazing_cosine` (cosine of the angle to their normal) send nothing back; 0: all do. */
double part_look(const part_place *place, const part_mount *mount, int rays, double reach, double grazing_cosine);

#endif
