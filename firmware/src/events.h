/* events.h: what has happened, kept in its order until it is collected: the link sends it to the host (link/event_delivery.h).
 *
 * Four wait at most. When there is no room, changes of one kind merge into the latest, which follows when there is. */
#ifndef EVENTS_H
#define EVENTS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
  uint32_t time;  /* clock_time() */
  uint16_t value; /* what it is for each kind: messages.toml */
  uint8_t kind;   /* EVENT_KIND_... */
} event;

void events_start(void);

/* Something has happened now. Main loop only. */
void events_raise(uint8_t kind, uint16_t value);

/* The oldest one that waits; NULL: none does. */
const event *events_first(void);

/* It has been collected. */
void events_drop_first(void);

/* Forgets touches of the whiskers: they are of no use to a host that comes later. Stops of the motors stay. */
void events_forget_touches(void);

/* Events that found no room in the queue and waited, or were merged, since the start, modulo 65536. */
uint16_t events_deferred(void);

#endif
