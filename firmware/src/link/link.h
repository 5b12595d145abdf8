/* link.h: the link as a whole: it starts, and frames that were received (receive.h) are carried out (dispatch.h). */
#ifndef LINK_H
#define LINK_H

#include <stdint.h>

/* Forgets everything and queues the hello; the line carries `baud` * 100 bit/s. */
void link_start(uint16_t baud);

/* Takes received bytes, up to the end of one frame, and carries it out. A message that has an answer waits until there is
 * room for the answer and, after it, for the next telemetry, which is never left out for the sake of answers; the messages
 * behind it wait, too. A stop and set-points do not wait themselves. */
void link_poll(void) __attribute__((noinline));

#endif
