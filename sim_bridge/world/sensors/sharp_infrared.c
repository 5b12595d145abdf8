/* sharp_infrared.c: see sharp_infrared.h. */
#include "sharp_infrared.h"

#include <math.h>

#define FOLD_CM 10.0

static double beyond_fold(double cm) { return 33.9 / (cm + 4.74); }

int sharp_infrared_init(sharp_infrared *self, const sharp_infrared_parameters *p) {
  if (beam_init(&self->beam, &p->beam)) return -1;
  if (!(p->reach >= 0.0 && p->sigma >= 0.0 && p->gain >= 0.0 && p->period >= 0.0 && p->late >= 0.0)) return -1;
  if (!isfinite(p->reach + p->sigma + p->gain + p->period) || (p->period > 0.0 && p->late > p->period)) return -1;
  self->reach = p->reach;
  self->sigma = p->sigma;
  self->gain = p->gain;
  self->period = p->period;
  self->late = p->period > 0.0 ? p->late : 0.0;
  return 0;
}

double sharp_infrared_volts(double distance) {
  const double cm = 100.0 * distance;
  return cm >= FOLD_CM ? beyond_fold(cm) : beyond_fold(FOLD_CM) * cm / FOLD_CM; /* the way back: a line (chosen) */
}

static double measure(const sharp_infrared *self, const viewpoint *from, noise_source *noise) {
  const beam_origin at = beam_from(&self->beam, from);
  double nearest = -1.0;
  for (int i = 0; i < self->beam.rays; i++) {
    const double d = beam_ray(&self->beam, from, at, i, self->reach, NULL);
    if (d >= 0.0 && (nearest < 0.0 || d < nearest)) nearest = d;
  }
  if (nearest < 0.0) return 0.0;
  const double spread = self->sigma > 0.0 ? 1.0 + self->sigma * noise_next_normal(noise) : 1.0; /* (3.1) */
  const double volts = self->gain * sharp_infrared_volts(nearest) * spread;
  return volts > 0.0 ? volts : 0.0;
}

double sharp_infrared_read(const sharp_infrared *self, sharp_infrared_state *state, const viewpoint *from, double time,
                           noise_source *noise) {
  if (time >= state->next) {
    if (time - state->next >= self->period) state->next = time;   /* the first time, or after a pause */
    if (state->pending_due > 0.0) state->output = state->pending; /* the one before is out by now */
    state->pending = measure(self, from, noise);
    state->pending_due = state->next + self->late;
    state->next += self->period;
  }
  if (time >= state->pending_due) state->output = state->pending;
  return state->output;
}

/* ---- of a robot without a board ----------------------------------------------------------------------------------- */

static size_t make(void *self, const void *parameters) { return sharp_infrared_init(self, parameters) == 0; }

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  *readings = sharp_infrared_read(self, (sharp_infrared_state *)memory->numbers, &s->from, s->time, noise);
}

const sensor_kind sharp_infrared_sensor = {
    .noise = 2, .size = sizeof(sharp_infrared), .numbers = 4, .make = make, .read = read};
