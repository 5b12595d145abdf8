/* board_access.h: a board by itself, for tests and tools: its pin log, its voltages, answers at its pins.
 *
 * In a simulated world the loop owns the board and its sink; here nobody else does. Works on every kind of board.
 * SPDX-License-Identifier: MIT
 */
#ifndef BOARD_ACCESS_H
#define BOARD_ACCESS_H

#include "board.h"

/* python: begin */
/* A pin log that grows. */
typedef struct {
  board_edge *edges;
  size_t first, end, capacity;
} board_log;

typedef struct {
  board *board;
  board_log log;
  double volts[6]; /* at analog channels 0..5 */
  double supply;   /* V; 0: the nominal one */
} board_access;

/* Becomes the board's sink and analog source. NULL if there is no memory or the board's interface is of another
 * version. */
board_access *board_access_open(board *target);

/* Lets go of the board without freeing it. */
void board_access_close(board_access *self);

/* Drives `pin` to `level` (LOW or HIGH) at `first`, to the other one `half` cycles later, and so on, `count` times. */
void board_access_drive_wave(board_access *self, uint64_t first, uint64_t half, size_t count, uint8_t pin,
                             uint8_t level);
/* python: end */

#endif
