/* native_board.h: an emulated board that runs the firmware's own C, compiled for the PC (firmware/src/hal/native).
 *
 * Each board loads its own copy of the firmware library, so that boards share no state, and a reset is the
 * unloading of that copy and the loading of a fresh one. Much faster than the AVR board; it has the same events at the
 * same cycles but for what the AVR's own instructions take: here the firmware's work takes no time. */
#ifndef NATIVE_BOARD_H
#define NATIVE_BOARD_H

#include <stddef.h>

#include "boards/board.h"

/* python: begin */
/* A board at cycle 0, just powered on, with the firmware library whose file has these bytes. NULL and one sentence in `error`
 * if it cannot be used. */
board *native_board_create(const uint8_t *image, size_t size, char *error, size_t error_size);
/* python: end */

#endif
