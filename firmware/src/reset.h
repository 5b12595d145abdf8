/* reset.h: why the microcontroller started, and a number that differs from start to start.
 *
 * The chip knows the cause, unless a bootloader has cleared it. Then a record in memory that a reset leaves alone helps:
 * the watchdog's interrupt marks it before the watchdog resets the chip. A whole record without a mark means an external
 * reset, a broken one that the power came. A reset by the watchdog whose interrupt was off, and a brown-out so short that
 * memory stayed whole, then look like external ones. */
#ifndef RESET_H
#define RESET_H

#include <stdint.h>

/* At start, before all others. */
void reset_start(void);

/* RESET_CAUSE_... of generated/values.h. That of a watchdog reset is RESET_CAUSE_WATCHDOG or, where a task ran,
 * RESET_CAUSE_WATCHDOG_IN_... of that one, which are above it. */
uint8_t reset_cause(void);

/* 1 + the number of the task that runs from now on; 0: none. A reset leaves it alone. */
void reset_note_running(uint8_t task);

/* Draws a nonce: 21 bits, not 0, another one at each call, also after a reset. After storage_start(). */
uint32_t reset_nonce(void);

#endif
