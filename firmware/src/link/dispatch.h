/* dispatch.h: what each message from the host makes the board do. */
#ifndef DISPATCH_H
#define DISPATCH_H

#include <stdbool.h>
#include <stdint.h>

/* Does what a whole, undamaged message to the board asks; `payload` has the length of its id. False if it was refused:
 * a value out of range, or nothing that can be done now. */
bool dispatch(uint8_t id, uint8_t sequence, const uint8_t *payload);

/* Bytes of room for which a message of that id waits, for its answer and the next telemetry; 0: it does not wait. (A hello
 * that finds no room is said later.) */
uint8_t dispatch_room(uint8_t id);

#endif
