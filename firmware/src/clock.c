/* clock.c: see clock.h. */
#include "clock.h"

#define SLOT_US (CLOCK_TICK_US / CLOCK_SLOTS_PER_TICK)
_Static_assert(HAL_SLOT_CYCLES == SLOT_US * HAL_CYCLES_PER_US, "both clocks go together");

volatile uint8_t clock_slot;
uint8_t clock_next_slot;

volatile uint32_t clock_slot_cycles;

static volatile uint32_t slot_us; /* time on the board's clock at which clock_slot began */

static uint32_t tick;
static uint32_t tick_us; /* time on the board's clock at which it begins, or has begun */

void clock_start(uint32_t first_tick) {
  clock_slot = 0xFF; /* the first slot is still to begin */
  clock_next_slot = 0;
  clock_slot_cycles = 0;
  tick = first_tick;
  tick_us = first_tick * CLOCK_TICK_US;
  slot_us = tick_us - SLOT_US;
}

uint16_t clock_begin_slot(void) {
  clock_slot++;
  const uint32_t start = clock_slot_cycles + HAL_SLOT_CYCLES;
  clock_slot_cycles = start;
  slot_us += SLOT_US;
  return (uint16_t)start;
}

uint32_t clock_now(void) {
  uint32_t start = 0;
  uint16_t time = 0;
  HAL_ATOMIC {
    start = clock_slot_cycles;
    time = hal_time();
  }
  return start + (uint16_t)(time - (uint16_t)start);
}

uint32_t clock_time(void) {
  uint32_t start = 0;
  uint16_t since = 0;
  HAL_ATOMIC {
    start = slot_us;
    since = (uint16_t)(hal_time() - (uint16_t)clock_slot_cycles);
  }
  return start + since / HAL_CYCLES_PER_US;
}

uint32_t clock_tick(void) { return tick; }

uint32_t clock_tick_time(void) { return tick_us; }

uint16_t clock_begun_tick(void) {
  const bool is_awaited = (int32_t)(clock_time() - tick_us) < 0; /* its tasks are, but it has not begun */
  return (uint16_t)((uint16_t)tick - is_awaited);
}

void clock_next_tick(void) {
  tick++;
  tick_us += CLOCK_TICK_US;
}
