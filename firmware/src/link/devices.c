/* devices.c: see devices.h. */
#include "link/devices.h"

#include <stdbool.h>

#include "generated/devices.h"
#include "link/frame.h"
#include "link/receive.h"
#include "link/send.h"
#include "link/session_seed.h"
#include "parameters.h"
#include "tasks.h"

#define LINE_SHARE 4u /* a message fills a quarter of the line at most */

typedef struct {
  uint8_t line_period; /* ticks */
  uint8_t since;       /* ticks, saturating */
} turn;

static turn turns[DEVICE_MESSAGES];
static uint8_t next; /* message whose turn it is to be looked at first */

void devices_start_line(void) {
  for (uint8_t i = 0; i < DEVICE_MESSAGES; i++) {
    turns[i] = (turn){.line_period = send_ticks((uint16_t)(LINE_SHARE * (device_message_length(i) + FRAME_OVERHEAD)))};
  }
}

static bool is_due(const turn *t) {
  return t->since >= t->line_period && t->since >= parameters_u16(PARAMETER_DEVICES_PERIOD);
}

/* In every tick: sends one of the messages that are due, in a session, if no message from the host waits for room for its
 * answer and the next telemetry has room after it. */
void devices_task(void) {
  for (uint8_t i = 0; i < DEVICE_MESSAGES; i++) {
    if (turns[i].since < UINT8_MAX) {
      turns[i].since++;
    }
  }
  if (!session_is_open() || receive_room != 0) {
    return;
  }
  next = next + 1u < DEVICE_MESSAGES ? (uint8_t)(next + 1u) : 0u;
  if (is_due(&turns[next]) && send_has_room(device_message_length(next)) && device_message_send(next)) {
    turns[next].since = 0;
  }
}
