/* events.c: see events.h. */
#include "events.h"

#include <stddef.h>

#include "bounds.h"
#include "clock.h"
#include "generated/values.h"

#define QUEUE 4u

/* In their order: the oldest stands at `first`. */
static event queue[QUEUE];
static uint8_t first, count;

/* What found no room there, of each kind the latest. It moves to the queue when that has room, the oldest first. */
static event later[EVENT_KIND_COUNT];
static bool waits[EVENT_KIND_COUNT];
static uint16_t deferred;

void events_start(void) {
  first = count = 0;
  deferred = 0;
  for (uint8_t kind = 0; kind < EVENT_KIND_COUNT; kind++) {
    waits[kind] = false;
  }
}

static void put(const event *what) {
  queue[(uint8_t)(first + count) % QUEUE] = *what;
  count++;
}

static void put_later(event *what) {
  deferred++;
  if (waits[what->kind] && what->kind == EVENT_KIND_WHISKERS) { /* its high byte: all that closed since */
    what->value = (uint16_t)(what->value | (later[what->kind].value & 0xFF00u));
  }
  later[what->kind] = *what;
  waits[what->kind] = true;
}

void events_raise(uint8_t kind, uint16_t value) {
  event what = {.time = clock_time(), .value = value, .kind = kind};
  if (count < QUEUE) {
    put(&what);
  } else {
    put_later(&what);
  }
}

const event *events_first(void) { return count != 0 ? &queue[first] : NULL; }

/* Moves the oldest of those that wait for room to the queue. */
static void fetch(void) {
  uint8_t oldest = EVENT_KIND_COUNT;
  for (uint8_t kind = 0; kind < EVENT_KIND_COUNT; kind++) {
    if (waits[kind] && (oldest == EVENT_KIND_COUNT || (int32_t)(later[kind].time - later[oldest].time) < 0)) {
      oldest = kind;
    }
  }
  if (oldest != EVENT_KIND_COUNT) {
    waits[oldest] = false;
    put(&later[oldest]);
  }
}

void events_drop_first(void) {
  first = (uint8_t)(first + 1u) % QUEUE;
  count--;
  fetch();
}

void events_forget_touches(void) {
  waits[EVENT_KIND_WHISKERS] = false;
  const uint8_t before = count;
  count = 0;
  for (uint8_t i = 0; i < before; i++) {
    LOOP_BOUND(QUEUE);
    const event kept = queue[(uint8_t)(first + i) % QUEUE];
    if (kept.kind != EVENT_KIND_WHISKERS) {
      put(&kept);
    }
  }
  for (uint8_t room = (uint8_t)(QUEUE - count); room != 0; room--) {
    LOOP_BOUND(QUEUE);
    fetch();
  }
}

uint16_t events_deferred(void) { return deferred; }
