/* counters.h: what this end of the link has counted; its message, and those of the tasks' times, one after another. */
#ifndef LINK_COUNTERS_H
#define LINK_COUNTERS_H

#include <stdbool.h>

#include "generated/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Counted where it happens, modulo 65536; good, bad, unknown and resynchronised are the decoder's (link.h). */
extern msg_counters counters;

void counters_start(void);

/* Received bytes were lost: it is counted in this tick, and told in the next telemetry. */
void counters_lose_bytes(void);

/* Whether it was counted since the last call. */
bool counters_bytes_lost(void);

#ifdef __cplusplus
}
#endif

#endif
