/* reset.c: what the ATmega328P knows of its resets, memory that survives them, and the watchdog (data sheet, 11). */
#include <avr/wdt.h>

#include "generated/values.h"
#include "hal/hal.h"

/* The start-up code leaves .noinit alone. It lies behind .data and .bss, so above the first 256 bytes, which bootloaders
 * use as a buffer, and far below their stack. */
static uint8_t noinit[HAL_NOINIT_SIZE] __attribute__((section(".noinit")));
static uint8_t saved_mcusr __attribute__((section(".noinit")));

/* After a watchdog reset the watchdog goes on with its shortest time: it is switched off before memory is set up. */
void hal_before_start(void) __attribute__((naked, used, section(".init3")));
void hal_before_start(void) {
  saved_mcusr = MCUSR;
  MCUSR = 0;
  wdt_disable();
}

uint8_t hal_reset_cause(void) {
  const uint8_t mcusr = saved_mcusr;
  if ((mcusr & _BV(PORF)) != 0) {
    return RESET_CAUSE_POWER;
  }
  if ((mcusr & _BV(BORF)) != 0) {
    return RESET_CAUSE_BROWN_OUT;
  }
  if ((mcusr & _BV(WDRF)) != 0) {
    return RESET_CAUSE_WATCHDOG;
  }
  return (mcusr & _BV(EXTRF)) != 0 ? RESET_CAUSE_EXTERNAL : RESET_CAUSE_UNKNOWN;
}

void *hal_noinit(void) { return noinit; }

/* FNV-1a from here up to the stack. */
uint32_t hal_memory_noise(void) {
  uint32_t hash = 0x811C9DC5ul;
  for (const uint8_t *byte = noinit; byte < (const uint8_t *)SP; byte++) {
    LOOP_BOUND(RAMEND + 1ul - RAMSTART);
    hash = (hash ^ *byte) * 0x01000193ul;
  }
  return hash;
}

static volatile bool has_expired;

void hal_start_watchdog(void) {
  HAL_ATOMIC {
    wdt_reset();
    WDTCSR = _BV(WDCE) | _BV(WDE);
    WDTCSR = _BV(WDIE) | _BV(WDE) | WDTO_120MS;
  }
}

void hal_kick_watchdog(void) {
  if (!has_expired) {
    wdt_reset();
  }
}

void hal_watchdog_reset(void) {
  has_expired = true;
  wdt_enable(WDTO_15MS);
}
