/* ping.h: Parallax Ping))), an ultrasonic range finder on one pin.
 *
 * The board raises the pin for at least 2 us and lets go; 750 us later the sensor raises it for the time that sound takes to
 * the nearest surface and back, at c = 331.5 + 0.6 T. No echo: 18.5 ms. Sound comes back from the nearest surface in the
 * beam that is not met too flatly.
 */
#ifndef PART_PING_H
#define PART_PING_H

#include "part.h"

/* python: begin */
typedef struct {
  double x, y, heading, beam; /* in the body's frame: m, m, rad, full opening in rad */
  double range_minimum_m, range_maximum_m;
  double temperature_c;
  double sigma;          /* relative spread of a reading, (3.1) */
  double miss;           /* probability that no echo is heard */
  double grazing_cosine; /* surfaces met flatter than this send nothing back */
  int rays;
} ping_parameters;
/* python: end */

#define PING_HEIGHT_M 0.08 /* above the floor */

enum { PING_ANSWER_WORLD = -1, PING_ANSWER_NONE = -2 };

typedef struct {
  part part;
  ping_parameters parameters;
  uint8_t high;
  uint64_t rise;
  uint64_t ready;      /* triggers before this cycle are not heard */
  int64_t answer;      /* length of every echo pulse, cycles; PING_ANSWER_WORLD, PING_ANSWER_NONE: no pulse at all */
  double distance;     /* of the last reading, m; -1: none */
  uint64_t ping_cycle; /* when it was triggered; 0: never */
  uint32_t pings;
} ping;

void ping_init(ping *self, const part_place *place, uint8_t pin, const ping_parameters *parameters);

/* The Ping that this part is, or NULL. */
ping *ping_of(part *base);

#endif
