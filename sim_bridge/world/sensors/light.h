/* light.h: a phototransistor: L = sum over the lamps of P max(0, cos theta) / (d0^2 + d^2).
 *
 * The law is the kit's own (docs/reference/notes.md).
 * A lamp behind something as high as the sensor does not count. Read by a capacitor's decay, bright light is a short time.
 */
#ifndef SENSORS_LIGHT_H
#define SENSORS_LIGHT_H

#include "sensor.h"

/* python: begin */
typedef struct {
  double x, y, heading, height; /* on the body; height of the sensor above the floor */
  double near_distance;         /* d0, m; chosen: 0.05 */
  double ambient;               /* what is there without any lamp; 0: darkness */
  double sigma;                 /* of (3.1); 0: no noise */
  double gain;                  /* of this unit, 1: nominal */
} phototransistor_parameters;

typedef struct {
  beam mount;
  double near_squared, ambient, sigma, gain;
} phototransistor;

/* 0, or -1: a bad mount, or a number that is not finite or negative, or d0 = 0. */
int phototransistor_init(phototransistor *self, const phototransistor_parameters *parameters);

/* Irradiance L >= 0 of the arena's lights. */
double phototransistor_read(const phototransistor *self, const viewpoint *from, noise_source *noise);

/* Time of the capacitor's decay, s: `scale` s at L = 1, never above `maximum`. */
double phototransistor_decay_time(double irradiance, double scale, double maximum);

extern const sensor_kind phototransistor_sensor;
/* python: end */

#endif
