/* link.h: the link as a whole: it starts, and frames that were received (receive.h) are carried out (dispatch.h). */
#ifndef LINK_H
#define LINK_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Forgets everything and queues the hello; the line carries `baud` * 100 bit/s. */
void link_start(uint16_t baud);

/* Takes received bytes, up to the end of one frame, and does what it asks. What is answered, and all that follows it, waits
 * while there is no room for its answer and, after that, for the next telemetry, which is never left out for the sake of
 * answers. A stop and set-points do not wait themselves. */
void link_poll(void) __attribute__((noinline));

#ifdef __cplusplus
}
#endif

#endif
