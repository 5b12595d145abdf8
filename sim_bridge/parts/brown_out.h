/* brown_out.h: what a weak supply does to the board (section 1.4 of the hardware's fact sheet; data sheet 11.5, 29.3).
 *
 * Below `reset_v` the brown-out detector holds the microcontroller in reset; it starts again above `reset_v` plus the
 * detector's hysteresis. Between that and `erratic_v`, which 16 MHz needs, it is out of its specification. What it does
 * there nobody publishes. Modelled: at random, the more often the lower, it loses its way, and its watchdog resets it at
 * once; what a derailed program would do until then is not modelled. Each of the two can be switched off.
 */
#ifndef PART_BROWN_OUT_H
#define PART_BROWN_OUT_H

#include "part.h"

/* python: begin */
typedef struct {
  double reset_v;      /* 2.7: the fuse; 0: no detector */
  double hysteresis_v; /* 0.05 */
  double erratic_v;    /* 3.78 */
  double upsets_per_s; /* at reset_v, falling in a straight line to none at erratic_v; 0, or without noise: never */
} brown_out_parameters;
/* python: end */

#define BROWN_OUT_NOISE 91u /* key of its noise */

typedef struct {
  brown_out_parameters parameters;
  noise_source noise;
  int held;        /* in reset now */
  uint32_t resets; /* by the detector */
  uint32_t upsets;
} brown_out;

/* A step of `dt` seconds at that voltage of the board's rail. */
void brown_out_step(brown_out *self, board *target, double volts, double dt);

#endif
