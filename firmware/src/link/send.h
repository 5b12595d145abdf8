/* send.h: messages to the host over the serial line. */
#ifndef LINK_SEND_H
#define LINK_SEND_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"
#include "link/frame.h"

/* The next frame is the first; the line carries `baud` * 100 bit/s. */
void send_start(uint16_t baud);

/* Sends a message with the seed of the open session; false if there is no room. A message that is not sent leaves a gap
 * in the sequence numbers, so that the host can count it, and is counted here. */
bool send_message(uint8_t id, const void *payload, uint8_t length);

/* Whether there is room for a message with a payload of that length and, after it, for the next telemetry, which is never
 * left out for the sake of others. If not, the main loop is woken when there is. */
#define SEND_RESERVE (MSG_TELEMETRY_LENGTH + 2u * FRAME_OVERHEAD) /* beside the payload */
bool send_has_room(uint8_t length);

/* Time that `bytes` take on the line: in ticks, rounded up, */
uint8_t send_ticks(uint16_t bytes);

/* and in half milliseconds, rounded down. */
uint16_t send_half_ms(uint8_t bytes);

#endif
