/* turret.h: a position servo (world/motor_position) that turns what is mounted on it, for example a range finder.
 *
 * It measures the width of each pulse on its pin, at the falling edge, and turns there with the world's steps; between them
 * the angle is interpolated.
 */
#ifndef PART_TURRET_H
#define PART_TURRET_H

#include "../world/motor_position.h"
#include "part.h"

typedef struct {
  part part;
  motor_position_parameters parameters;
  motor_position motor;
  part_turret carried; /* what mounted parts look at */
  part_pulse pulse;
} turret;

/* python: begin */
typedef struct {
  double x, y; /* of its axis, in the body's frame, m */
  motor_position_parameters motor;
} turret_parameters;

/* It looks straight ahead at first. Shows its angle, rad. Parameters: turret_parameters. Pin: the signal. */
extern const part_kind turret_kind;
/* python: end */

/* The turret that this part is, or NULL. */
turret *turret_of(part *base);

#endif
