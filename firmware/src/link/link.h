/* link.h: what comes over the serial line: bytes into frames, frames to dispatch. Sending is in send.h. */
#ifndef LINK_H
#define LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"
#include "hal/hal.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Forgets everything and queues the hello; the line carries `baud` * 100 bit/s. */
void link_start(uint16_t baud);

/* From now on frames of that session are accepted; FRAME_NO_SESSION: only the handshake's. What waits for room is
 * forgotten. */
void link_use_seed(uint32_t seed);

/* Takes received bytes, up to the end of one frame; false unless it is accepted. A part of link_poll(). */
bool link_take_frame(void) __attribute__((noinline));

/* Takes received bytes, up to the end of one frame, and does what it asks. What is answered, and all that follows it, waits
 * while there is no room for its answer and, after that, for the next telemetry, which is never left out for the sake of
 * answers. A stop and set-points do not wait themselves. */
void link_poll(void) __attribute__((noinline));

extern uint8_t link_room; /* not 0: a message waits in the decoder for so many bytes of room; for 0 there always is */

/* Not 0: there is something for link_poll() to do. */
uint8_t link_due(void);

/* Frames accepted, refused and of unknown messages, and times that a good one followed bad ones, into the counters. */
void link_count(msg_counters *into);

#ifdef __cplusplus
}
#endif

#endif
