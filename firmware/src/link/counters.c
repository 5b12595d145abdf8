/* counters.c: see counters.h. */
#include "link/counters.h"

#include <string.h>

#include "hal/hal.h"
#include "link/link.h"
#include "link/send.h"
#include "link/session.h"
#include "link/telemetry.h"

#define PERIOD 64u /* ticks on a fast line */

msg_counters counters;
static bool bytes_lost;
static uint16_t ticks; /* since they were sent */

void counters_start(void) {
  HAL_ZERO(counters);
  HAL_ZERO(bytes_lost);
  HAL_ZERO(ticks);
}

void counters_count_at(uint8_t offset) {
  uint8_t *const at = (uint8_t *)&counters + offset;
  uint16_t count = 0;
  memcpy(&count, at, sizeof count);
  count++;
  memcpy(at, &count, sizeof count);
}

bool counters_bytes_lost(void) {
  const bool lost = bytes_lost;
  bytes_lost = false;
  return lost;
}

void counters_task(void) {
  if (hal_serial_overrun()) {
    counters_count(overrun);
    bytes_lost = true;
  }
  ticks++;
  if (!session_is_open() || ticks < PERIOD * telemetry_line_period() || !send_has_room(sizeof counters)) {
    return;
  }
  ticks = 0;
  link_count(&counters);
  send_message(MSG_COUNTERS_ID, &counters, sizeof counters);
}
