/* avr_instructions.h: how instructions are executed: the common ones, which touch registers, RAM, program memory and
 * nothing else, here and fast; all others by simavr's core. Both take the same time and do the same.
 *
 * A recorder has the run stop where something is to be recorded.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#ifndef AVR_INSTRUCTIONS_H
#define AVR_INSTRUCTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "avr_board.h"

struct avr_board;

typedef struct {
  uint8_t marked[AVR_BOARD_FLASH_SIZE / 2u]; /* by word of flash; not 0: it stops before the instruction there */
  uint16_t lowest, highest;                  /* it stops when the stack pointer is not from here to here */
} instruction_stops;

/* What the next instruction does to data memory, registers r0 to r31 aside. */
typedef struct {
  uint16_t first; /* cell */
  uint8_t count;  /* 0: nothing */
  bool writes;    /* else it reads */
} data_access;

data_access next_access(const struct avr_board *b);

/* Executes instructions, one at least, until cycle `until` or until one of them wants the core to stop; with `stops`,
 * which may be NULL, also there. The next one's address is then in `pc`; returns the last one's. */
uint32_t execute_instructions(struct avr_board *b, uint64_t until, const instruction_stops *stops);

#endif
