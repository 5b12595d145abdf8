/* sample_hold.h: a sensor with its own rate: between samples it gives the held value (notes, section 3.2.2: the limited
 * frequency of readings is another source of noise). */
#ifndef SENSORS_SAMPLE_HOLD_H
#define SENSORS_SAMPLE_HOLD_H

#include <stdint.h>

/* python: begin */
typedef struct {
  double period; /* s; 0: a new value at each question */
  double next;   /* s: when the next sample is due */
  double taken;  /* s: when the last one was taken */
  double value;
} sample_hold;

/* 1 if a new sample is due at `time` s; the caller then takes it by sample_hold_take. */
int sample_hold_due(const sample_hold *self, double time);
void sample_hold_take(sample_hold *self, double time, double value);
/* python: end */

#endif
