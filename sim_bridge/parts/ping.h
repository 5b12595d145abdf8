/* ping.h: Parallax Ping))), an ultrasonic range finder on one pin.
 *
 * The board raises the pin for at least 2 us and lets go; 750 us later the sensor raises it for the time that sound takes to
 * the nearest surface and back (world/sensors/sonar). No echo: 18.5 ms.
 */
#ifndef PART_PING_H
#define PART_PING_H

#include "../world/sensors/sonar.h"
#include "part.h"

enum { PING_ANSWER_WORLD = -1, PING_ANSWER_NONE = -2 };

typedef struct {
  part part;
  beam_parameters mount;
  sonar sonar;
  part_pulse pulse;
  uint64_t ready;      /* triggers before this cycle are not heard */
  int64_t answer;      /* length of every echo pulse, cycles; PING_ANSWER_WORLD, PING_ANSWER_NONE: no pulse at all */
  double distance;     /* of the last reading, m; -1: none */
  uint64_t ping_cycle; /* when it was triggered; 0: never */
  uint32_t pings;
} ping;

/* python: begin */
/* Parameters: sonar_parameters. Pin: the signal. */
extern const part_kind ping_kind;
/* python: end */

/* The Ping that this part is, or NULL. */
ping *ping_of(part *base);

#endif
