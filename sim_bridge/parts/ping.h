/* ping.h: ultrasonic range finders: Parallax's Ping))) on one pin, and the HC-SR04 on two.
 *
 * The board sends a pulse, and lets go of the pin where it is the only one; some time later the sensor raises its pin for the
 * time that sound takes to the nearest surface and back (world/sensors/sonar). Nothing heard: a pulse of a fixed length.
 *
 *            trigger        echo begins after   nothing heard
 *   Ping)))  2 us to 1 ms   750 us              18.5 ms            Parallax, document 28015
 *   HC-SR04  10 us or more  some 460 us (the    38 ms              Elecfreaks, HC-SR04 User Guide; the delay, in which
 *                           burst takes 200)                       eight cycles of 40 kHz go out, is in no sheet
 *
 * Triggers are not heard while the echo pulse lasts.
 * Faults, of triggers that end while they act: missing, no pulse; late, by s; doubled, the same pulse again s after its end.
 */
#ifndef PART_PING_H
#define PART_PING_H

#include "../world/sensors/sonar.h"
#include "part.h"

typedef struct {
  part part;
  sonar sonar;
  part_pulse pulse;
  uint8_t echo_pin, idle_level;              /* what it does to that pin between two echoes */
  uint64_t trigger_minimum, trigger_maximum; /* cycles */
  uint64_t delay, nothing; /* from the trigger to the echo pulse, and its length if nothing is heard */
  uint64_t shortest;       /* echo pulse */
  uint64_t rest;           /* after the echo pulse */
  uint64_t ready;          /* triggers before this cycle are not heard */
  double distance;         /* of the last reading, m; -1: none */
  uint64_t ping_cycle;     /* when it was triggered; 0: never */
  uint32_t pings;
} ping;

/* python: begin */
typedef struct {
  sonar_parameters sonar;
  double delay_s;   /* from the trigger's end to the echo pulse */
  double nothing_s; /* length of the pulse if nothing is heard */
} ultrasonic_parameters;

/* Both show the distance that they last found (m; -1: nothing near), and how long ago (s; -1: never). */

/* Parameters: sonar_parameters. Pin: the signal. */
extern const part_kind ping_kind;

/* Parameters: ultrasonic_parameters. Pins: trigger and echo, which may be one. */
extern const part_kind ultrasonic_kind;
/* python: end */

#endif
