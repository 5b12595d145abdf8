/* motion.c: see motion.h. */
#include "motion.h"

#include <math.h>

#define FULL_SIGNAL 10000 /* a signal of 1 on the line */
#define PULSE_MIN 20800   /* 1300 us */
#define PULSE_MAX 27200   /* 1700 us */

int32_t motion_pulse_of(const motion_map *map, double signal) {
  const int32_t product = map->gain * (int32_t)rint(signal * FULL_SIGNAL);
  const int32_t half = FULL_SIGNAL / 2;
  const int32_t pulse = map->centre + (product + (product < 0 ? -half : half)) / FULL_SIGNAL;
  return pulse < PULSE_MIN ? PULSE_MIN : (pulse > PULSE_MAX ? PULSE_MAX : pulse);
}
