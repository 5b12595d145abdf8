/* link_polls.c: how long the link waits between two polls, and what waits for it. In place of the firmware's main.c, and
 * linked by --wrap=link_poll, so that every poll comes by here; link_polls.py builds it and reads the variables. */
#include "firmware.h"
#include "hal/hal.h"
#include "link/link.h"

void __real_link_poll(void);
void __wrap_link_poll(void);

volatile uint16_t longest_gap; /* cycles from one poll to the next, or from the end of a sleep */
volatile uint8_t most_waiting; /* bytes in the receive ring at a poll */

static uint16_t last;

static uint16_t now(void) {
  uint16_t time = 0;
  HAL_ATOMIC { time = hal_time(); }
  return time;
}

void __wrap_link_poll(void) {
  const uint16_t time = now();
  const uint16_t gap = (uint16_t)(time - last);
  last = time;
  if (gap > longest_gap) {
    longest_gap = gap;
  }
  const uint8_t waiting = (uint8_t)(HAL_RECEIVE_HEAD - HAL_RECEIVE_TAIL);
  if (waiting > most_waiting) {
    most_waiting = waiting;
  }
  __real_link_poll();
}

int main(void) {
  firmware_start();
  for (;;) {
    firmware_poll();
    hal_sleep_until(firmware_due);
    last = now();
  }
}
