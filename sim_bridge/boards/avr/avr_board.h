/* avr_board.h: the Arduino Uno's ATmega328P, emulated.
 */
#ifndef AVR_BOARD_H
#define AVR_BOARD_H

#include <stddef.h>
#include <stdint.h>

#include "../board.h"
#include "core/avr_chip.h"

/* python: begin */
/* A program as it lies in the chip's memories. */
typedef struct {
  const uint8_t *flash;   /* AVR_FLASH_SIZE bytes */
  const uint8_t *eeprom;  /* BOARD_EEPROM_SIZE bytes */
  uint8_t high_fuse;      /* says where the boot section begins, and whether a reset leads there (avr_chip.h) */
  uint32_t code_end;      /* behind the last byte that can be an instruction */
  uint16_t variables_end; /* first address of data memory behind the variables */
} avr_program;

/* A board with that program, powered on at cycle 0; NULL: there is no memory for it. */
board *avr_board_create(const avr_program *program);

/* For tests: from now on each instruction is executed by itself, and sleep goes by cycle by cycle. All is the same. */
void avr_board_no_fast_forward(board *self);

/* From now on keeps what was executed of each word of flash: bit 0, and it went straight on; bit 1, and it went elsewhere, by a
 * jump, a skip or over a second word. AVR_FLASH_SIZE / 2 bytes, the board's; NULL: no memory. */
uint8_t *avr_board_cover(board *self);
/* python: end */

#endif
