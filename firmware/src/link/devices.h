/* devices.h: telemetry of the slow devices, beside that of every tick (telemetry.h). */
#ifndef LINK_DEVICES_H
#define LINK_DEVICES_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Finds how often the line can carry it; after send_start(). */
void devices_start_line(void);

/* In every tick: sends it when it is its turn, in a session, while one of the devices is on, if no message from the host
 * waits for room for its answer and the next telemetry has room after it. */
void devices_task(void) __attribute__((noinline));

#ifdef __cplusplus
}
#endif

#endif
