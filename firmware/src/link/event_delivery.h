/* event_delivery.h: sends the host what has happened (events.h), exactly once and in order (protocol/PROTOCOL.md, "Delivery"): the
 * oldest event is under way and is sent again until the host acknowledges it. */
#ifndef LINK_EVENT_DELIVERY_H
#define LINK_EVENT_DELIVERY_H

#include <stdint.h>

/* A new session: numbers begin at 1. */
void event_delivery_start(void);

/* The host has the event of that number. */
void event_delivery_acknowledge(uint16_t number);

#endif
