/* sonar.h: an ultrasonic range finder: a beam of rays, of which the nearest surface that sends sound back counts.
 *
 * Two readings of the same echo: the notes' (nearest distance with probability p, else D_max; never below D_min; noise by
 * (3.1)) and the Ping's, which is the echo's time at c = 331.5 + 0.6 T (Parallax, document 28015). Surfaces met too
 * flatly turn the sound away; soft ones swallow it.
 */
#ifndef SENSORS_SONAR_H
#define SENSORS_SONAR_H

#include "sensor.h"

/* python: begin */
typedef struct {
  beam_parameters beam;                /* notes: 3 rays over 0.35 rad */
  double range_minimum, range_maximum; /* D_min, D_max, m; Ping: 0.02, 3.0 (data) */
  double sigma;                        /* of (3.1) on the distance; notes: 0.01; 0: no noise */
  double miss;                         /* 1 - p, probability that no echo is heard; notes: 0.02; 0: never */
  double grazing_cosine; /* surfaces met at more than that angle to their normal send nothing back; 0: all do */
  double temperature;    /* of the air, degrees C */
  int absorption;        /* 1: the range goes with the square root of the surface's sound reflectance; 0: all reflect */
} sonar_parameters;

typedef struct {
  beam beam;
  double range_minimum, range_maximum, sigma, miss, grazing_cosine, temperature;
  int absorption;
} sonar;

/* 0, or -1: a bad beam, a number that is not finite or negative, D_min >= D_max, a probability or cosine above 1, or a
 * temperature outside -100 ... 200. */
int sonar_init(sonar *self, const sonar_parameters *parameters);

/* Distance of the nearest surface that sends sound back, m; -1: none. Without noise and misses. */
double sonar_distance(const sonar *self, const viewpoint *from);

/* The same with noise and misses: what one ping finds, or -1; in [D_min, D_max]. */
double sonar_ping(const sonar *self, const viewpoint *from, noise_source *noise);

/* The notes' reading, m: D_max stands for nothing heard. */
double sonar_read(const sonar *self, const viewpoint *from, noise_source *noise);

/* Speed of sound in air of that temperature (degrees C), m/s, and the time of an echo from that distance (m), s. */
double sonar_speed_of_sound(double temperature);
double sonar_echo_time(const sonar *self, double distance);

extern const sensor_kind sonar_sensor;

/* A Ping))) at a board. Reading: length of its echo pulse as the firmware takes it, us. */
typedef sonar_parameters ping_parameters;
extern const sensor_kind ping_sensor;
/* python: end */

/* The Ping's echo pulse: not shorter than, and so long where nothing is heard (Parallax, document 28015). */
#define PING_SHORTEST_US 115
#define PING_NOTHING_US 18500

#endif
