/* infrared.h: an infra-red LED and a receiver for bursts of 36 to 42 kHz that looks the same way.
 *
 * The receiver's output is high. After a few cycles of the carrier on the LED's pin it goes low if something within range
 * sends enough light back, and it stays low until the carrier has been gone for a few cycles. It hears 38.5 kHz best;
 * the farther the carrier is from that, the nearer an object must be. Now and then it sees what is not there.
 */
#ifndef PART_INFRARED_H
#define PART_INFRARED_H

#include "part.h"

/* python: begin */
typedef struct {
  double x, y, heading, beam; /* in the body's frame: m, m, rad, full opening in rad */
  double range_m;             /* at 38 kHz */
  double range_sigma;         /* relative spread of the range from burst to burst */
  double false_hit;           /* probability per burst */
  int rays;
} infrared_parameters;

/* Share of the range that is left at a carrier of that period. */
double infrared_range_share(uint32_t period_cycles);
/* python: end */

#define INFRARED_HEIGHT_M 0.06 /* above the floor */

typedef struct {
  part part;
  uint8_t receiver_pin;
  infrared_parameters parameters;
  uint64_t last_rise;
  uint32_t carrier_cycles; /* in a row */
  uint8_t seen;            /* in this burst */
  double distance;         /* at the last burst, m; -1: nothing in the beam */
  double reach;            /* of the last burst, m */
  uint64_t burst_cycle;    /* when it was recognised; 0: never */
  uint32_t bursts;
} infrared;

void infrared_init(infrared *self, const part_place *place, uint8_t led_pin, uint8_t receiver_pin,
                   const infrared_parameters *parameters);

#endif
