/* events.c: see events.h. */
#include "link/events.h"

#include <stdbool.h>

#include "generated/messages.h"
#include "link/counters.h"
#include "link/parameters.h"
#include "link/send.h"
#include "link/session.h"
#include "schedule.h"

#define PLACES 4u
#define KINDS (EVENT_KIND_DEAD_MAN + 1u)
#define RETRY_BYTES 200u /* on the line, besides two ticks */

typedef struct {
  uint8_t kind;
  uint16_t value;
  uint32_t time; /* schedule_time() */
} happening;

static happening queue[PLACES];
static uint8_t first, count; /* queue[first] is under way */
static uint16_t number;      /* of the event under way, or of the next one */
static bool sent;            /* it was sent at least once, last at: */
static uint32_t sent_at;     /* schedule_time() */
static uint32_t retry_us;    /* as tick and line have it */

/* What found no room: the latest of each kind. Everything in the queue is older. */
static happening latest[KINDS];
static uint8_t merged; /* bits: kinds that wait there */

void events_start(void) {
  first = 0;
  count = 0;
  number = 1;
  sent = false;
  merged = 0;
  retry_us = 2u * SCHEDULE_TICK_US + send_time(RETRY_BYTES);
}

static void append(const happening *what) {
  queue[(uint8_t)(first + count) % PLACES] = *what;
  count++;
}

void events_raise(uint8_t kind, uint16_t value) {
  if (!session_is_open()) {
    return;
  }
  happening what = {kind, value, schedule_time()};
  if (count < PLACES) {
    append(&what);
    return;
  }
  if (kind == EVENT_KIND_WHISKERS && (merged & 1u << kind) != 0) { /* the high byte: all that closed since */
    what.value = (uint16_t)(value | (latest[kind].value & 0xFF00u));
  }
  latest[kind] = what;
  merged = (uint8_t)(merged | 1u << kind);
  counters.deferred++;
}

/* A place is free: it goes to the oldest of what waits beside the queue. */
static void take_merged(void) {
  uint8_t oldest = KINDS;
  for (uint8_t kind = 0; kind < KINDS; kind++) {
    if ((merged & 1u << kind) != 0 && (oldest == KINDS || (int32_t)(latest[kind].time - latest[oldest].time) < 0)) {
      oldest = kind;
    }
  }
  append(&latest[oldest]);
  merged = (uint8_t)(merged & ~(1u << oldest));
}

void events_acknowledge(uint16_t arrived) {
  if (arrived != number || !sent) { /* another one, acknowledged before */
    return;
  }
  number++;
  first = (uint8_t)(first + 1u) % PLACES;
  count--;
  sent = false;
  if (merged != 0) {
    take_merged();
  }
}

static uint32_t retry_time(void) {
  const uint16_t wanted = parameters_u16(PARAMETER_RETRY_TIME);
  return wanted != 0 ? wanted * 1000ul : retry_us;
}

void events_task(void) {
  if (count == 0) {
    return;
  }
  const uint32_t now = schedule_time();
  if ((sent && now - sent_at < retry_time()) || !send_has_room(MSG_EVENT_LENGTH)) {
    return;
  }
  const happening *what = &queue[first];
  const msg_event event = {.number = number, .kind = what->kind, .value = what->value, .time = what->time};
  send_message(MSG_EVENT_ID, &event, sizeof event);
  if (sent) {
    counters.retransmitted++;
  }
  sent = true;
  sent_at = now;
}
