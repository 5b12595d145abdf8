/* events.c: see events.h. */
#include "link/events.h"

#include <stdbool.h>

#include "bounds.h"
#include "generated/messages.h"
#include "link/counters.h"
#include "link/link.h"
#include "link/parameters.h"
#include "link/send.h"
#include "link/session.h"
#include "schedule.h"

#define QUEUE 4u
#define KINDS (EVENT_KIND_DEAD_MAN + 1u)
#define PLACES (QUEUE + KINDS)
#define RETRY_BYTES 200u /* on the line, besides two ticks */
#define TICK (SCHEDULE_TICK_US / 500u)
#define SLOT (TICK / SCHEDULE_SLOTS_PER_TICK)

/* The first `count` of `order` are the places of those that wait, in the order in which they happened: the first is under
 * way; behind the QUEUE of them stands what found no room there, at most one of each kind. The others are free. Numbers are
 * given when they are sent. */
static msg_event events[PLACES];
static uint8_t order[PLACES];
static uint8_t count;

static uint16_t number; /* of the event under way, or of the next one */
static bool sent;       /* it was sent at least once */
static uint16_t wait;   /* half milliseconds until it is sent again */

static __attribute__((noinline)) void none_under_way(void) {
  sent = false;
  wait = 0;
}

void events_start(void) {
  BOUNDED(PLACES, for (uint8_t i = 0; i < PLACES; i++)) {
    order[i] = i;
  }
  count = 0;
  number = 1;
  none_under_way();
}

/* Frees the place of the event that is there in the order. */
static void forget(uint8_t *at) {
  const uint8_t place = *at;
  BOUNDED(PLACES - 1u, for (; at != &order[PLACES - 1u]; at++)) {
    at[0] = at[1];
  }
  *at = place;
  count--;
}

void events_raise(uint8_t kind, uint16_t value) {
  if (!session_is_open()) {
    return;
  }
  if (count >= QUEUE) {
    counters_count(deferred);
  }
  BOUNDED(KINDS, for (uint8_t *at = &order[QUEUE]; at < &order[count]; at++)) {
    const msg_event *const before = &events[*at];
    if (before->kind == kind) {
      if (kind == EVENT_KIND_WHISKERS) { /* the new one has the latest value; the high byte: all that closed since */
        value = (uint16_t)(value | (before->value & 0xFF00u));
      }
      forget(at);
      break;
    }
  }
  msg_event *const event = &events[order[count]];
  count++;
  event->kind = kind;
  event->value = value;
  event->time = schedule_time();
}

void events_acknowledge(uint16_t arrived) {
  if (arrived != number || !sent) { /* another one, acknowledged before */
    return;
  }
  number++;
  none_under_way();
  forget(order);
}

/* From one sending to the next, in half milliseconds. */
static uint16_t retry_time(void) {
  const uint16_t wanted = parameters_u16(PARAMETER_RETRY_TIME); /* ms, up to 2000 */
  return wanted != 0 ? (uint16_t)(wanted * 2u) : (uint16_t)(2u * TICK + send_half_ms(RETRY_BYTES));
}

void events_task(void) {
  if (wait > SLOT) {
    wait = (uint16_t)(wait - SLOT);
    return;
  }
  /* Repetitions must not take the room that a message waits for. */
  if (count == 0 || link_room != 0 || !send_has_room(MSG_EVENT_LENGTH)) {
    return;
  }
  msg_event *const first = &events[order[0]];
  first->number = number;
  send_message(MSG_EVENT_ID, first, sizeof *first);
  if (sent) {
    counters_count(retransmitted);
  }
  sent = true;
  wait = retry_time();
}
