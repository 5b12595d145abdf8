/* infrared_pair.h: the light between an infra-red LED and the 38 kHz receiver beside it.
 *
 * What returns falls with the square of the distance, so the range goes with the square root of the receiver's sensitivity
 * at the carrier's frequency (peak 38.5 kHz, 50 % at 40, 20 % at 42: Parallax, "Robotics with the Board of Education
 * Shield for Arduino", chapter 8) and of the surface's reflectance. A sweep over five frequencies sorts objects into zones.
 * Another robot's burst is seen directly, from much farther away.
 */
#ifndef SENSORS_INFRARED_PAIR_H
#define SENSORS_INFRARED_PAIR_H

#include "sensor.h"

/* python: begin */
typedef struct {
  beam_parameters beam;
  double range;       /* m, at 38 kHz, for a white surface */
  double range_sigma; /* relative spread of the range from burst to burst, (3.1); 0: none */
  double
      false_hit; /* probability per burst that light from elsewhere (fluorescent lamps) looks like an echo; 0: never */
  double
      direct; /* m: from how far the LED of another pair is seen by the receiver at 38 kHz; 0: never (no cross-talk) */
} infrared_pair_parameters;

typedef struct {
  beam beam;
  double range, range_sigma, false_hit, direct;
  double edge_cosine; /* of half the opening */
} infrared_pair;

/* What one burst met. */
typedef struct {
  double reach;    /* m, of this burst */
  double distance; /* m, of what was seen; -1: nothing */
  int seen;        /* 1: the receiver's output goes low */
} infrared_look;

/* A burst that is in the air: the LED's place and direction in the world. */
typedef struct {
  double x, y, cosine, sine;
  double edge_cosine; /* of half its beam's opening */
  double height;
  double frequency; /* Hz */
  uint32_t id;      /* of the robot that sends it */
} infrared_burst;

/* 0, or -1: a bad beam, or a number that is not finite or negative, or a probability above 1. */
int infrared_pair_init(infrared_pair *self, const infrared_pair_parameters *parameters);

/* Share of the range at 38 kHz that is left at a carrier of that frequency, Hz. */
double infrared_carrier_share(double frequency);

/* One burst at that frequency. */
infrared_look infrared_pair_look(const infrared_pair *self, const viewpoint *from, double frequency,
                                 noise_source *noise);

/* The burst that this pair's LED sends. */
infrared_burst infrared_pair_burst(const infrared_pair *self, const viewpoint *from, double frequency);

/* 1 if the receiver sees the light of another robot's burst directly (cross-talk). */
int infrared_pair_sees_burst(const infrared_pair *self, const viewpoint *from, const infrared_burst *burst);

/* Reading: 1 if a burst at the carrier of firmware/src/infrared.c is seen, else 0. */
extern const sensor_kind infrared_pair_sensor;
/* python: end */

#define INFRARED_CARRIER_HZ (16e6 / 422.0) /* half a period is 211 cycles */

#endif
