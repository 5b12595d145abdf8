/* buzzer.h: a piezo speaker: it hears its pin and logs what it sounds, one row per tone.
 *
 * A tone has at least two periods that are alike (BUZZER_LIKENESS). It ends with its last falling edge when the next edge
 * does not come in time, or where another pitch begins. The world does not hear it.
 */
#ifndef PART_BUZZER_H
#define PART_BUZZER_H

#include "part.h"

#define BUZZER_LIKENESS 0.03 /* relative: what a toggling interrupt may jitter */

typedef struct {
  part part;
  uint8_t high;
  uint64_t rise, fall; /* the last ones */
  uint64_t begin;      /* first rise of the tone under way */
  uint32_t periods;    /* of it; 0: silence, or one pulse so far */
  uint64_t sum;        /* of these periods, cycles */
  uint64_t period;     /* its first one, cycles */
  uint64_t odd;        /* the last one, if it was unlike, cycles; 0: it was not */
} buzzer;

/* python: begin */
/* Without parameters. Pin: the signal. */
extern const part_kind buzzer_kind;
/* python: end */

#endif
