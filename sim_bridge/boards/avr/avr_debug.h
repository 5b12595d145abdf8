/* avr_debug.h: what a debugger asks of the emulated ATmega328P. Off until `avr_board_debug`, and then free.
 *
 * Where the program stops, the board calls the debugger from within `advance`: no cycle passes until that returns, so
 * that a run with a debugger is the run without it. Watched data memory makes each instruction run by itself; a
 * breakpoint does not. What an interrupt's entry puts on the stack is not watched.
 */
#ifndef AVR_DEBUG_H
#define AVR_DEBUG_H

#include <stdbool.h>
#include <stdint.h>

#include "../board.h"

/* python: begin */
/* Why the program stands still, by the number of the signal that says it; AVR_LOOKS: it runs, and the debugger may stop it
 * is asked now and then. */
typedef enum {
  AVR_LOOKS = 0,
  AVR_WATCHED = 1, /* the last instruction has read or written a watched cell */
  AVR_INTERRUPTED = 2,
  AVR_TRAPPED = 5, /* behind a step, or before the instruction at a breakpoint */
  AVR_CRASHED = 11
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

/* Calls `debugger` from now on; NULL: none any more. NULL: no memory. */
avr_debug *avr_board_debug(board *self, avr_debugger *debugger);

/* A byte at an address as ELF files and gdb have it: flash from 0, data from 0x800000 (registers as a program would read
 * them now, without what that would change), EEPROM from 0x810000. -1, false: nothing is there. */
int avr_debug_read(board *self, uint32_t address);
bool avr_debug_write(board *self, uint32_t address, uint8_t value);

/* As by the reset button, at once. */
void avr_debug_reset(board *self);
/* python: end */

#endif
