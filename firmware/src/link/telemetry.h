/* telemetry.h: everything the board knows, once per tick. */
#ifndef TELEMETRY_H
#define TELEMETRY_H

#ifdef __cplusplus
extern "C" {
#endif

/* Collects and sends. Latest wins: without room on the line it is left out, and the host sees the gap. */
void telemetry_task(void);

#ifdef __cplusplus
}
#endif

#endif
