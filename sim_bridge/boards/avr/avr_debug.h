/* avr_debug.h: what a debugger asks of the emulated ATmega328P. Off until `avr_board_debug`, and then free.
 *
 * Where the program stops, the board calls the debugger from within `advance`: no cycle passes until that returns, so
 * that a run with a debugger is the run without it. Watched data memory makes each instruction run by itself; a
 * breakpoint does not. What an interrupt's entry puts on the stack is not watched.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#ifndef AVR_DEBUG_H
#define AVR_DEBUG_H

#include <stdbool.h>
#include <stdint.h>

#include "../board.h"

/* python: begin */
typedef enum {
  AVR_LOOKS, /* it runs: now and then, for whoever wants to stop it */
  AVR_INTERRUPTED,
  AVR_STEPPED,
  AVR_REACHED, /* a breakpoint; the instruction there is the next one */
  AVR_READ,    /* the last instruction has read a watched cell, */
  AVR_WROTE,   /* or written one */
  AVR_CRASHED
} avr_halt;

/* Returns 0 for the program to go on; else `advance` ends with BOARD_STOPPED. */
typedef int avr_debugger(void *context, avr_halt why);

enum { AVR_WATCH_READ = 1, AVR_WATCH_WRITE = 2 };

typedef struct {
  uint8_t *breakpoints; /* by word of flash: not 0 where one is */
  uint8_t *watched;     /* by address of data memory: AVR_WATCH_READ, AVR_WATCH_WRITE or both */
  bool watching;        /* some cell is watched */
  bool stepping;        /* to stop after the next instruction */
  bool interrupted;     /* to stop now */
  uint16_t accessed;    /* the watched cell */
  uint32_t pc;          /* byte address of the next instruction */
} avr_debug;

/* Calls `debugger` from now on; NULL: nobody any more. NULL: no memory. */
avr_debug *avr_board_debug(board *self, avr_debugger *debugger);

/* A byte at an address as ELF files and gdb have it: flash from 0, data from 0x800000 (registers as a program would read
 * them now, without what that would change), EEPROM from 0x810000. -1, false: nothing is there. */
int avr_debug_read(board *self, uint32_t address);
bool avr_debug_write(board *self, uint32_t address, uint8_t value);

/* As by the reset button, at once. */
void avr_debug_reset(board *self);
/* python: end */

#endif
