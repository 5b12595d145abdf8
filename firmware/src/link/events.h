/* events.h: what happened, told to the host exactly once and in order (protocol/PROTOCOL.md, "Delivery").
 *
 * Four events wait at most; the first of them is under way and is sent again until the host acknowledges it. When there is
 * no room, changes of one kind merge into its latest state, which follows when there is. */
#ifndef LINK_EVENTS_H
#define LINK_EVENTS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A new session: numbers begin at 1, nothing waits. */
void events_start(void);

/* Something happened now; without a session there is nobody to tell. Main loop only. */
void events_raise(uint8_t kind, uint16_t value);

/* The host has the event of that number. */
void events_acknowledge(uint16_t number);

/* In every slot: sends the event under way when it is its time. */
void events_task(void) __attribute__((noinline));

#ifdef __cplusplus
}
#endif

#endif
