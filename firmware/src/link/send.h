/* send.h: messages to the host over the serial line. */
#ifndef LINK_SEND_H
#define LINK_SEND_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"
#include "link/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The next frame is the first; the line carries `baud` * 100 bit/s. */
void send_start(uint16_t baud);

/* From now on frames are made with that session's seed. */
void send_use_seed(uint32_t seed);

/* Sends a message; false if there is no room. A message that is not sent leaves a gap in the sequence numbers, so that
 * the host can count it, and is counted here. */
bool send_message(uint8_t id, const void *payload, uint8_t length);

/* Whether there is room for a message with a payload of that length and, after it, for the next telemetry, which is never
 * left out for the sake of others. If not, the CPU is woken when there is. */
#define SEND_ROOM(length) ((uint8_t)((length) + MSG_TELEMETRY_LENGTH + 2u * FRAME_OVERHEAD))
static inline bool send_has_room(uint8_t length) { return hal_serial_room(SEND_ROOM(length)); }

/* Time in us that so many bytes take on the line. */
uint32_t send_time(uint16_t bytes);

#ifdef __cplusplus
}
#endif

#endif
