/* reset.h: why the microcontroller started, and a number that tells this start from others.
 *
 * The chip tells the cause, unless a bootloader has cleared it. Then a record in memory that a reset leaves alone helps:
 * the watchdog's interrupt marks it before the watchdog resets the chip. Without a mark the cause is unknown. */
#ifndef RESET_H
#define RESET_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* First of all at start. */
void reset_start(void);

/* RESET_CAUSE_... of generated/messages.h. */
uint8_t reset_cause(void);

/* Draws a nonce: 21 bits, not 0, another one at each call, also after a reset. After storage_start(). */
uint32_t reset_nonce(void);

#ifdef __cplusplus
}
#endif

#endif
