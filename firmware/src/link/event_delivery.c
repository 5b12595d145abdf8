/* event_delivery.c: see event_delivery.h. */
#include "link/event_delivery.h"

#include <stdbool.h>
#include <stddef.h>

#include "clock.h"
#include "events.h"
#include "generated/messages.h"
#include "link/counters.h"
#include "link/receive.h"
#include "link/send.h"
#include "link/session_seed.h"
#include "parameters.h"
#include "tasks.h"

#define RETRY_BYTES 200u /* on the line, besides two ticks */
#define TICK (CLOCK_TICK_US / 500u)
#define CALL (TICK / 2u) /* from one call of the task to the next */

static uint16_t number; /* of the event under way, or of the next one */
static bool sent;       /* it was sent at least once */
static uint16_t wait;   /* half milliseconds until it is sent again */

static void none_under_way(void) {
  sent = false;
  wait = 0;
}

void event_delivery_start(void) {
  number = 1;
  none_under_way();
}

void event_delivery_acknowledge(uint16_t arrived) {
  if (arrived != number || !sent) { /* another one, acknowledged before */
    return;
  }
  number++;
  none_under_way();
  events_drop_first();
}

/* From one sending to the next, in half milliseconds. */
static uint16_t retry_time(void) {
  const uint16_t wanted = parameters_u16(PARAMETER_RETRY_TIME); /* ms, up to 2000 */
  return wanted != 0 ? (uint16_t)(wanted * 2u) : (uint16_t)(2u * TICK + send_half_ms(RETRY_BYTES));
}

/* Twice a tick: sends the event under way when it is its time. */
void events_task(void) {
  if (wait > CALL) {
    wait = (uint16_t)(wait - CALL);
    return;
  }
  const event *const first = events_first();
  /* Repetitions must not take the room that a message waits for. */
  if (first == NULL || !session_is_open() || receive_room != 0 || !send_has_room(MSG_EVENT_LENGTH)) {
    return;
  }
  const msg_event message = {.number = number, .kind = first->kind, .value = first->value, .time = first->time};
  send_message(MSG_EVENT_ID, &message, sizeof message);
  if (sent) {
    counters.retransmitted++;
  }
  sent = true;
  wait = retry_time();
}
