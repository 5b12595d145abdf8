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

#define PLACES 4u
#define KINDS (EVENT_KIND_DEAD_MAN + 1u)
#define RETRY_BYTES 200u /* on the line, besides two ticks */
#define TICK (SCHEDULE_TICK_US / 500u)
#define SLOT (TICK / SCHEDULE_SLOTS_PER_TICK)

/* In the order in which they happened. The first is under way; behind the PLACES of the queue stands what found no room in
 * it, at most one of each kind. Numbers are given when they are sent. */
static msg_event queue[PLACES + KINDS];
static msg_event *end;  /* behind the last */
static uint16_t number; /* of the event under way, or of the next one */
static bool sent;       /* it was sent at least once */
static uint16_t wait;   /* half milliseconds until it is sent again */

static __attribute__((noinline)) void none_under_way(void) {
  sent = false;
  wait = 0;
}

void events_start(void) {
  end = queue;
  number = 1;
  none_under_way();
}

void events_raise(uint8_t kind, uint16_t value) {
  if (!session_is_open()) {
    return;
  }
  if (end >= queue + PLACES) {
    counters_count(deferred);
    msg_event *kept = queue + PLACES;
    BOUNDED(KINDS, for (const msg_event *event = kept; event < end; event++)) {
      if (event->kind != kind) {
        *kept++ = *event;
      } else if (kind ==
                 EVENT_KIND_WHISKERS) { /* the new one has the latest value; the high byte: all that closed since */
        value = (uint16_t)(value | (event->value & 0xFF00u));
      }
    }
    end = kept;
  }
  msg_event *const event = end++;
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
  end--;
  BOUNDED(PLACES + KINDS - 1u, for (msg_event *event = queue; event != end; event++)) {
    event[0] = event[1];
  }
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
  if (end == queue || link_room != 0 || !send_has_room(MSG_EVENT_LENGTH)) {
    return;
  }
  queue->number = number;
  send_message(MSG_EVENT_ID, queue, sizeof *queue);
  if (sent) {
    counters_count(retransmitted);
  }
  sent = true;
  wait = retry_time();
}
