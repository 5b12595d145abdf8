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

/* Takes received bytes, up to the end of one frame, and does what it asks. A request, and all that follows it, waits
 * while there is no room for its answer and, after that, for the next telemetry, which is never left out for the sake of
 * answers. */
void link_poll(void);

extern bool link_request_waits;

static inline __attribute__((always_inline)) bool link_due(void) {
  return hal_serial_due() != 0 &&
         (!link_request_waits || hal_serial_room(FRAME_SIZE_MAX + MSG_TELEMETRY_LENGTH + FRAME_OVERHEAD));
}

/* Frames refused since reset, modulo 256. */
uint8_t link_frames_bad(void);

#ifdef __cplusplus
}
#endif

#endif
