/* main.c: start, then do what is due and sleep until the next interrupt. */
#include "firmware.h"
#include "hal/hal.h"

int main(void) {
  firmware_start();
  for (;;) {
    firmware_poll();
    hal_sleep_until(firmware_due);
  }
}
