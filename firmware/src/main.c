/* main.c: start; then do the work that is due, and sleep until an interrupt brings more. */
#include "firmware.h"
#include "hal/hal.h"

int main(void) {
  firmware_start();
  for (;;) {
    firmware_poll();
    if (hal_sleeps()) {
      cli(); /* so that nothing becomes due between the question and the sleep */
      while (firmware_due() == 0) {
        hal_sleep();
      }
      sei();
    }
  }
}
