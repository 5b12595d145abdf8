/* counters.h: what this end of the link has counted; its message, and those of the tasks' times, one after another. */
#ifndef LINK_COUNTERS_H
#define LINK_COUNTERS_H

#include <stdbool.h>
#include <stddef.h>

#include "generated/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Counted where it happens, modulo 65536; good, bad and resynchronised are the decoder's (link.h). */
extern msg_counters counters;

void counters_start(void);

/* Counts one, in the field of that name. */
#define counters_count(field) counters_count_at(offsetof(msg_counters, field))
void counters_count_at(uint8_t offset);

/* In every tick: looks whether received bytes were lost; in a session sends one task's longest time or the counters
 * now and then. */
void counters_task(void) __attribute__((noinline));

/* Whether received bytes were lost since the last call. */
bool counters_bytes_lost(void);

#ifdef __cplusplus
}
#endif

#endif
