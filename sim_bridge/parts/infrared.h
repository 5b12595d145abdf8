/* infrared.h: an infra-red LED and a receiver for bursts of 36 to 42 kHz that looks the same way.
 *
 * The receiver's output is high. After a few cycles of the carrier it goes low if enough light reaches it
 * (world/sensors/infrared_pair), and it stays low until the carrier has been gone for a few cycles.
 *
 * What it hears is the mean frequency. Its filter has half of its peak at 40 kHz, a quality of 22, so it sums the cycles of
 * 22 / pi = 7 periods, weighed by age: an edge that comes late, since its interrupt had to wait, is one of many. The part
 * takes the mean of 8 cycles first, and judges anew after 24, when such a filter has settled.
 *
 * Light is that of the own LED, thrown back by something within range, or that of another robot's LED (cross-talk), or
 * imagined. Another robot's light arrives one world step late: that is what two boards that run one after the other can
 * know of each other. Fault: blinded, by light of its carrier: the output is low throughout.
 */
#ifndef PART_INFRARED_H
#define PART_INFRARED_H

#include "../world/sensors/infrared_pair.h"
#include "part.h"

#define INFRARED_FOREIGN 8            /* bursts of others that wait to be seen */
#define INFRARED_CYCLES_TO_HEAR 8u    /* before the first look */
#define INFRARED_CYCLES_TO_SETTLE 24u /* before the last */

/* Light from elsewhere: the receiver is lit from one cycle to another. */
typedef struct {
  uint64_t from, until;
} infrared_light;

typedef struct {
  part part;
  infrared_pair pair;
  uint64_t last_rise;
  uint64_t rises[INFRARED_CYCLES_TO_SETTLE]; /* the last ones, by carrier_cycles modulo their number */
  double period;                             /* of the carrier, cycles */
  noise_source drawn;                        /* the noise of this burst: the second look has the same */
  uint32_t carrier_cycles;                   /* in a row */
  uint8_t seen;                              /* in this burst */
  uint64_t lit_until;                        /* by the own burst: the output is low until then */
  infrared_light foreign[INFRARED_FOREIGN];  /* by increasing time */
  int foreign_count;
  /* what the LED sent since others last heard of it */
  uint64_t sent_from, sent_until; /* the same cycle: nothing */
} infrared;

/* python: begin */
/* Parameters: infrared_pair_parameters. Pins: LED and receiver. */
extern const part_kind infrared_kind;
/* python: end */

/* The pair that this part is, or NULL. */
infrared *infrared_of(part *base);

/* What its LED sent since the last call, if it sent anything: 1, the burst, and from when until when its carrier lasted. */
int infrared_take_burst(infrared *self, infrared_burst *burst, infrared_light *span);

/* The LED of another robot sent `burst` during `span`, all cycles of this board. */
void infrared_see_burst(infrared *self, const infrared_burst *burst, const infrared_light *span);

#endif
