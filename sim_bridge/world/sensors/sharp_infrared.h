/* sharp_infrared.h: Sharp GP2Y0A21 / GP2D12, an IR triangulation sensor with a voltage at its output.
 *
 * V = 33.9 / (d + 4.74) with d in cm; below 10 cm the voltage falls again, so a near object looks like a far one. A new
 * value every 38.3 +- 9.6 ms, which is at the output 7.6 ms later (data sheet of the GP2D12).
 */
#ifndef SENSORS_SHARP_INFRARED_H
#define SENSORS_SHARP_INFRARED_H

#include "sensor.h"

/* python: begin */
typedef struct {
  beam_parameters beam; /* one ray is what triangulation sees */
  double reach;         /* m; beyond it the output is 0; data: 0.8 m are specified, about 1.5 m are seen (chosen) */
  double sigma;         /* of (3.1) on the voltage; chosen: 0.01; 0: no noise */
  double gain;          /* of this unit, 1: nominal */
  double period;        /* s; 0.0383 +- 0.0096 from unit to unit (data); 0: each time it is asked */
  double late;          /* s; 0.0076 (data) */
} sharp_infrared_parameters;

typedef struct {
  beam beam;
  double reach, sigma, gain, period, late;
} sharp_infrared;

typedef struct {
  double next;        /* s: when the next distance is measured */
  double pending;     /* V, measured and not yet at the output */
  double pending_due; /* s */
  double output;      /* V */
} sharp_infrared_state;

/* 0, or -1: a bad beam, a number that is not finite or negative, or `late` longer than a period. */
int sharp_infrared_init(sharp_infrared *self, const sharp_infrared_parameters *parameters);

/* The characteristic: volts at d metres, d >= 0. */
double sharp_infrared_volts(double distance);

/* Voltage at the output at `time` s, which does not go back. */
double sharp_infrared_read(const sharp_infrared *self, sharp_infrared_state *state, const viewpoint *from, double time,
                           noise_source *noise);

extern const sensor_kind sharp_infrared_sensor;
/* python: end */

#endif
