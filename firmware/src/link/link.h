/* link.h: what comes over the serial line: bytes into frames, frames to dispatch. Sending is in send.h. */
#ifndef LINK_H
#define LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"
#include "link/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Forgets everything and queues the hello. */
void link_start(void);

/* Takes received bytes, up to the end of one frame, and does what it asks. Bytes wait while there is no room for an
 * answer and, after it, for the next telemetry, which is never left out for the sake of answers. */
void link_poll(void);
static inline bool link_due(void) {
  return hal_serial_received() && hal_serial_room(FRAME_SIZE_MAX + MSG_TELEMETRY_LENGTH + FRAME_OVERHEAD);
}

/* Frames refused since reset, modulo 256. */
uint8_t link_frames_bad(void);

#ifdef __cplusplus
}
#endif

#endif
