/* send.h: messages to the host over the serial line. */
#ifndef LINK_SEND_H
#define LINK_SEND_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The next frame is the first. */
void send_start(void);

/* Sends a message; false if there is no room. A message that is not sent leaves a gap in the sequence numbers, so that
 * the host can count it. */
bool send_message(uint8_t id, const void *payload, uint8_t length);

#ifdef __cplusplus
}
#endif

#endif
