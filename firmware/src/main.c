/* main.c: start, then do what is due and sleep until an interrupt has more. */
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
