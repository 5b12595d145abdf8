/* turret.h: a position servo (world/motor_position) that turns what is mounted on it, for example the Ping.
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
  uint8_t high;
  uint64_t rise;
} turret;

/* A turret whose axis stands at (x, y) of the body's frame, m; it looks straight ahead. */
void turret_init(turret *self, const part_place *place, uint8_t pin, double x, double y,
                 const motor_position_parameters *parameters);

/* The turret that this part is, or NULL. */
turret *turret_of(part *base);

#endif
