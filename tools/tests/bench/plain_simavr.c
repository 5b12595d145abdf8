/* plain_simavr.c: the firmware image in Debian's simavr (libsimavr-dev), with its own run loop, nothing on its pins and nobody
 * on its line: what our emulated board is measured against.
 *
 *   plain_simavr IMAGE.hex SECONDS      prints the wall-clock seconds of a run of SECONDS board seconds
 *
 * A program made of this and of simavr is under simavr's licence, GPL-3.0-or-later; it is part of nothing that is installed. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "avr_uart.h"
#include "sim_avr.h"
#include "sim_hex.h"

static void do_not_sleep(avr_t *avr, avr_cycle_count_t cycles) {
  (void)avr;
  (void)cycles;
}

static double wall_seconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

int main(int count, char **arguments) {
  if (count != 3) return 2;
  avr_t *avr = avr_make_mcu_by_name("atmega328p");
  if (avr == NULL || avr_init(avr) != 0) return 1;
  uint32_t size = 0, start = 0;
  uint8_t *image = read_ihex_file(arguments[1], &size, &start);
  if (image == NULL) return 1;
  avr->frequency = 16000000;
  avr->log = 0;
  avr_loadcode(avr, image, size, start);
  avr->codeend = size + start - 1;
  avr->sleep = do_not_sleep;
  uint32_t flags = 0; /* neither a copy of each line on standard output nor a pause when the status is polled */
  avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
  const avr_cycle_count_t end = (avr_cycle_count_t)(atof(arguments[2]) * 16e6);
  const double started = wall_seconds();
  while (avr->cycle < end) {
    const int state = avr_run(avr);
    if (state == cpu_Done || state == cpu_Crashed) return 1;
  }
  printf("%.6f\n", wall_seconds() - started);
  return 0;
}
