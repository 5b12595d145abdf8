/* receive.h: bytes from the serial line into frames. */
#ifndef LINK_RECEIVE_H
#define LINK_RECEIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"
#include "link/frame.h"

/* Forgets everything; no session is open. */
void receive_start(void);

/* From now on frames of that session are accepted; FRAME_NO_SESSION: only the handshake's. What waits for room is
 * forgotten. */
void receive_use_seed(uint32_t seed);

/* Takes received bytes, up to the end of one frame; false unless it is accepted. A part of link_poll(). */
bool receive_frame(void) __attribute__((noinline));

extern frame_decoder receive_decoder; /* the frame that was accepted last */

extern uint8_t receive_room; /* bytes of room that a message in the decoder waits for; 0: none waits */

/* Not 0: there is something for link_poll() to do. */
uint8_t receive_due(void);

/* Frames accepted, refused and of unknown messages, and times that a good one followed bad ones, into the counters. */
void receive_count(msg_counters *into);

#endif
