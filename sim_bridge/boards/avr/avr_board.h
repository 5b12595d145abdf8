/* avr_board.h: the Arduino Uno's ATmega328P, emulated: simavr executes the instructions, this layer does the rest.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#ifndef AVR_BOARD_H
#define AVR_BOARD_H

#include <stddef.h>
#include <stdint.h>

#include "../board.h"

/* python: begin */
/* A board with the program of an ELF file (its bytes, not its name) in flash, powered on at cycle 0. On failure NULL,
 * and one sentence in `error`. */
board *avr_board_create(const uint8_t *elf, size_t size, char *error, size_t error_size);

/* For tests of what else is faster: from now on each instruction is executed by itself, and by simavr's core. */
void avr_board_one_by_one(board *self);
/* python: end */

#define AVR_BOARD_FLASH_SIZE 0x8000u /* bytes */

#endif
