/* avr_checks.h: what a program does that a bench does not show: two that drive one pin against each other, an input that
 * nothing decides, RAM that is read before it is written. Off until `avr_board_check`, and then free.
 */
#ifndef AVR_CHECKS_H
#define AVR_CHECKS_H

#include <stdbool.h>

#include "../board.h"

/* python: begin */
/* Notes these things from now on, at each place once; `strict`: the first one is a fault. False: no memory. */
bool avr_board_check(board *self, bool strict);
/* python: end */

#endif
