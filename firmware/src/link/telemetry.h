/* telemetry.h: everything the board knows, once per tick or less often. */
#ifndef TELEMETRY_H
#define TELEMETRY_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Finds how often the line can carry it; after send_start(). */
void telemetry_start_line(void);

/* A new session: the next tick is told. */
void telemetry_start(void);

/* In every tick: collects and sends when it is its turn in a session. Latest wins: without room on the line it is left
 * out, and the host sees the gap. */
void telemetry_task(void) __attribute__((noinline));

/* Ticks from one to the next: as the parameter wants it, but no more often than every telemetry_line_period() ticks, so
 * that it fills half of the line at most. */
uint8_t telemetry_period(void);
uint8_t telemetry_line_period(void);

#ifdef __cplusplus
}
#endif

#endif
