/* counters.c: see counters.h. */
#include "link/counters.h"

#include "hal/hal.h"

msg_counters counters;
static bool lost_in_tick, bytes_lost;

void counters_start(void) {
  counters = (msg_counters){0};
  lost_in_tick = bytes_lost = false;
}

void counters_lose_bytes(void) { lost_in_tick = true; }

void counters_end_tick(void) {
  if (hal_serial_overrun()) {
    counters_lose_bytes();
  }
  if (lost_in_tick) {
    counters.overrun++;
    bytes_lost = true;
    lost_in_tick = false;
  }
}

bool counters_bytes_lost(void) {
  const bool lost = bytes_lost;
  bytes_lost = false;
  return lost;
}
