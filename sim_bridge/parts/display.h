/* display.h: a character display with an HD44780U controller, of two lines of 16 letters, in 4-bit mode.
 *
 * Hitachi's data sheet of the HD44780U: instructions (table 6), addresses of the display's memory (pages 10 and 11), reset
 * on power-on (page 23), initialisation by nibbles (figure 24), and the ROM A00. R/W is at ground: the program waits, it
 * cannot ask. DB0 to DB3 are open, which while the bus has 8 bits reads as 0 here.
 */
#ifndef PART_DISPLAY_H
#define PART_DISPLAY_H

#include "part.h"

/* python: begin */
enum { DISPLAY_LINES = 2, DISPLAY_LETTERS = 16 };

typedef struct {
  double oscillator; /* its frequency, of the nominal 270 kHz */
} display_parameters;

/* Parameters: display_parameters. Pins: RS, E, DB4, DB5, DB6, DB7. */
extern const part_kind display_kind;
/* python: end */

#endif
