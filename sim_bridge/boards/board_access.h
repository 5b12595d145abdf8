/* board_access.h: a board by itself, for tests and tools: its pin log, its voltages, its operations as functions; and what
 * lies inside any board, also one in a simulated world.
 *
 * In a simulated world the loop owns the board and its sink; here nobody else does. Works on every kind of board.
 * SPDX-License-Identifier: MIT
 */
#ifndef BOARD_ACCESS_H
#define BOARD_ACCESS_H

#include "board.h"

typedef struct {
  uint64_t cycle;
  uint8_t pin;
  uint8_t level; /* LOW, HIGH, RELEASED, PULLED_UP */
} board_edge;

/* A pin log that grows. Its `board_log_add` is a board_edge_sink with the log as context. */
typedef struct {
  board_edge *edges;
  size_t count;
  size_t capacity;
} board_log;

void board_log_add(void *log, uint64_t cycle, uint8_t pin, uint8_t level);
void board_log_clear(board_log *log);
void board_log_free(board_log *log);

typedef struct {
  board *board;
  board_log log;
  double volts[6]; /* at analog channels 0..5 */
  double supply;   /* V; 0: the nominal one */
  int echo_pin;    /* pin whose every output edge is answered on `echo_to`, or -1; tests of answers from the sink */
  int echo_to;
  uint64_t echo_delay;
} board_access;

/* Becomes the board's sink and analog source. NULL if there is no memory or the board's interface is of another
 * version. */
board_access *board_access_open(board *target);

/* Lets go of the board without freeing it. */
void board_access_close(board_access *self);

uint64_t board_access_now(const board_access *self);
int board_access_advance(board_access *self, uint64_t until);
void board_access_drive(board_access *self, uint64_t at, uint8_t pin, uint8_t level);
/* Drives `pin` to `level` (LOW or HIGH) at `first`, to the other one `half` cycles later, and so on, `count` times. */
void board_access_drive_wave(board_access *self, uint64_t first, uint64_t half, size_t count, uint8_t pin,
                             uint8_t level);
void board_access_send(board_access *self, uint64_t at, const uint8_t *bytes, size_t count);
size_t board_access_receive(board_access *self, uint8_t *bytes, uint64_t *cycles, size_t capacity);
void board_access_line_rate(board_access *self, uint32_t baud);
void board_access_reset(board_access *self, int cause);

/* ---- of any board */

void board_free(board *self);
uint8_t board_output(const board *self, uint8_t pin); /* what the program does to a pin now */
void board_count(const board *self, board_counters *out);
const char *board_fault(const board *self); /* one sentence about a crash, or NULL */
int64_t board_fault_address(board *self);   /* see BOARD_FAULT_ADDRESS; -1: not known */

/* Data space of the microcontroller, to be read or written; NULL on a board that has none. */
uint8_t *board_memory(board *self);

/* NULL on a board that has none. */
board_eeprom *board_eeprom_of(board *self);

/* NULL on a board that has no watchdog. */
const board_watchdog_log *board_watchdog_log_of(board *self);
const board_notes *board_notes_of(board *self);

#endif
