/* script_board.h: a board that runs a script in place of firmware: output edges queued by the caller come out at their cycles,
 * and what the outside drives is noted. For testing and trying parts without any firmware.
 */
#ifndef SCRIPT_BOARD_H
#define SCRIPT_BOARD_H

#include "boards/board.h"

/* python: begin */
typedef struct script_board script_board;

/* A board, or NULL without memory. */
script_board *script_board_new(void);
void script_board_destroy(script_board *self);

/* Its address, as sim_add_robot takes it. */
uintptr_t script_board_address(script_board *self);

/* The board will do `level` to `pin` at `cycle`. Edges are queued in increasing order. Returns 0, or -1 if they are not,
 * or without memory. */
int script_board_edge(script_board *self, uint64_t cycle, uint8_t pin, uint8_t level);

/* A byte will leave the board; its stop bit ends at `cycle`. Increasing order. */
int script_board_byte(script_board *self, uint64_t cycle, uint8_t byte);

/* What was driven on a pin and is no longer in the future: cycles and levels, oldest first. Returns how many there are. */
size_t script_board_inputs(const script_board *self, uint8_t pin, uint64_t *cycles, uint8_t *levels, size_t capacity);

/* Bytes that were sent to the board. Returns how many there are. */
size_t script_board_sent(const script_board *self, uint8_t *bytes, size_t capacity);

/* The voltage at an analog channel, sampled now. */
double script_board_volts(script_board *self, uint8_t channel);

/* From now on every advance fails, as a crash would. */
void script_board_crash(script_board *self);
/* python: end */

#endif
