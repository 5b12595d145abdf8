/* whisker.h: a wire that closes a switch to ground when something bends it; a resistor pulls the pin up otherwise.
 *
 * The wire is a segment on the body. The switch bounces: for some milliseconds after a change its contact opens and closes a
 * few times.
 * Faults: stuck, open (0) or pressed (1), whatever bends it; bouncing, by a mean in s (part_bounce).
 */
#ifndef PART_WHISKER_H
#define PART_WHISKER_H

#include "part.h"

/* python: begin */
typedef struct {
  double root_x, root_y, tip_x, tip_y; /* in the body's frame, m */
  double height;                       /* above the floor, m: what is lower does not bend it */
  double bounce_s;                     /* mean, of part_bounce; 0: none */
} whisker_parameters;
/* python: end */

typedef struct {
  part part;
  whisker_parameters parameters;
  uint8_t pressed;
} whisker;

/* python: begin */
/* Shows whether it is bent. Parameters: whisker_parameters. Pin: the switch. */
extern const part_kind whisker_kind;
/* python: end */

#endif
