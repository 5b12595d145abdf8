/* buzzer.h: a piezo speaker: it is at its pin, whose edges are what it sounds. The world does not hear it. */
#ifndef PART_BUZZER_H
#define PART_BUZZER_H

#include "part.h"

/* python: begin */
/* Without parameters. Pin: the signal. */
extern const part_kind buzzer_kind;
/* python: end */

#endif
