/* line.h: three line sensors that look at the floor (Parallax QTI): an infra-red LED and a phototransistor, which discharges
 * a capacitor: over a bright floor soon, over a dark line late. As the light sensors they are charged for a slot, let go,
 * and the time of the decay is measured: all three at once, once in each servo frame (20 ms), charged in its last slot, let go
 * in its first. Nothing waits for the edges: the pin change of port D stamps them. */
#ifndef LINE_H
#define LINE_H

#include <stdbool.h>

#include "generated/messages.h"

void line_start(void);

/* Fills in its fields of line_telemetry; false: it is off. */
bool line_report_line_telemetry(msg_line_telemetry *message);

#endif
