/* avr_core.h: simavr's instruction loop with a second face, for a recorder: it stops where something is to be recorded.
 *
 * simavr's own, `avr_run_one`, executes instructions until `run_cycle_count` cycles are over or an instruction wants it
 * to stop. build_avr.py makes both faces from the same text of sim_core.c, so that they execute alike.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#ifndef AVR_CORE_H
#define AVR_CORE_H

#include <stdbool.h>
#include <stdint.h>

#include "avr_board.h"
#include "sim_avr.h"

typedef struct {
  uint8_t marked[AVR_BOARD_FLASH_SIZE / 2u]; /* by word of flash; not 0: it stops before the instruction there */
  uint16_t lowest, highest;                  /* it stops when the stack pointer is not from here to here */
} avr_core_stops;

/* Like avr_run_one: executes at least one instruction, returns the next one's address and leaves that of the last one
 * in `pc`. */
avr_flashaddr_t avr_run_stopping(avr_t *avr, const avr_core_stops *stops);

static inline bool core_stops_before(const avr_t *avr, const avr_core_stops *stops, uint32_t pc) {
  uint16_t stack = (uint16_t)(avr->data[R_SPL] | avr->data[R_SPH] << 8);
  return (uint16_t)(stack - stops->lowest) > (uint16_t)(stops->highest - stops->lowest) || pc >= AVR_BOARD_FLASH_SIZE ||
         stops->marked[pc / 2u];
}

#endif
