/* dispatch.h: what each message from the host makes the board do. */
#ifndef DISPATCH_H
#define DISPATCH_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

void dispatch_start(void);

/* Does what a whole, undamaged message asks; `payload` has the length of its id. False if it was refused: not a message
 * to the board, or a value out of range. */
bool dispatch(uint8_t id, uint8_t sequence, const uint8_t *payload);

/* Whether a message of that id is answered. */
bool dispatch_answers(uint8_t id);

/* Sequence number of the last set-point that was accepted. */
uint8_t dispatch_setpoint_sequence(void);

#ifdef __cplusplus
}
#endif

#endif
