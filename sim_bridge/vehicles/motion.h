/* motion.h: how a board makes servo pulses of motor signals, to the bit as firmware/src/motion.c does it.
 *
 *   pulse = centre + gain * signal, rounded to 1/16 us and clamped to 1300..1700 us
 *
 * The signal goes over the line in 1/10000. This room includes nothing of the firmware: a test compares both for all signals.
 */
#ifndef VEHICLES_MOTION_H
#define VEHICLES_MOTION_H

#include <stdint.h>

/* python: begin */
/* Of one wheel, in counts of 1/16 us; a mirrored servo has a negative gain. */
typedef struct {
  int32_t centre, gain;
} motion_map;

/* The pulse of a motor signal in [-1, 1], in counts of 1/16 us. */
int32_t motion_pulse_of(const motion_map *map, double signal);
/* python: end */

#define MOTION_COUNTS_PER_US 16.0

#endif
