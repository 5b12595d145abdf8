/* counters.h: the counters of the board's end of the link. */
#ifndef LINK_COUNTERS_H
#define LINK_COUNTERS_H

#include <stdbool.h>

#include "generated/messages.h"

/* Counted where it happens, modulo 65536; good, bad, unknown and resynchronised are the decoder's (receive.h). */
extern msg_counters counters;

void counters_start(void);

/* Received bytes were lost: it is counted in this tick, and the next telemetry says so. */
void counters_lose_bytes(void);

/* In every tick: counts whether bytes were lost, here or in the chip. */
void counters_end_tick(void);

/* Whether it was counted since the last call. */
bool counters_bytes_lost(void);

#endif
