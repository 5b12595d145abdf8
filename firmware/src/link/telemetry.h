/* telemetry.h: everything the board knows, once per tick or less often. */
#ifndef TELEMETRY_H
#define TELEMETRY_H

#include <stdint.h>

/* Finds how often the line can carry it; after send_start(). */
void telemetry_start_line(void);

/* A new session: the next tick is sent. */
void telemetry_start(void);

/* Ticks from one to the next: as the parameter wants it, but no more often than every telemetry_line_period() ticks, so
 * that it fills half of the line at most. */
uint8_t telemetry_period(void);
uint8_t telemetry_line_period(void);

#endif
