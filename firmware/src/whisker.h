/* whisker.h: the two whiskers, debounced. A whisker shorts its pin to ground when pressed and bounces for up to 10 ms.
 *
 * Sampled in every slot (2.5 ms). Pressed after 2 pressed samples in a row, released after 4 released ones: a touch or
 * its end is in the telemetry within two ticks and raises an event, and a bounce that still touches once in 10 ms is one
 * touch. */
#ifndef WHISKER_H
#define WHISKER_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"

typedef struct {
  bool pressed;
  uint8_t streak; /* samples in a row that say otherwise */
} whisker_state;

/* Takes one sample; returns whether the whisker now counts as pressed. */
bool whisker_debounce(whisker_state *state, bool touching);

void whisker_start(void);

/* WHISKERS_... bits. */
uint8_t whisker_read(void);

/* Fills in its fields of telemetry. */
void whisker_report_telemetry(msg_telemetry *message);

#endif
