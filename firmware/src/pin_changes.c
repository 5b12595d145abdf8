/* pin_changes.c: see pin_changes.h. */
#include "pin_changes.h"

#include "bounds.h"
#include "clock.h"
#include "encoder.h"
#include "hal/hal.h"
#include "hal/interrupts.h"
#include "light.h"
#include "tasks.h"

#define RING 64u
#define DUE 8u     /* changes */
#define CLOSE 256u /* cycles, 16 us: changes nearer than that are close; a bounce of 20 us is not */
#define STORM 5u   /* changes in a row, each but the first close to the one before */
/* Interrupts in a slot that find no pin changed; more are noise. Four lines of 4,000 edges/s make 40 edges in a slot; in pairs,
 * 20 interrupts find nothing new. */
#define UNSEEN_MAX 40u

_Static_assert(RING == CONSTANT_changes_ring && DUE == CONSTANT_changes_due, "constants of tasks.def");

/* Shared with the interrupt: a ring of changes, hal_time() and the levels of the port. Where head and tail are equal, none
 * waits; one place stays free. */
static volatile uint16_t times[RING];
static volatile uint8_t levels[RING];
static volatile uint8_t head, tail;
static volatile uint8_t stopped; /* not 0: all pins are masked until the main loop has looked */

/* The interrupt's own. */
static uint16_t last_time;
static uint8_t close_row; /* changes in a row that were close */

/* Main loop only. */
static uint8_t before;  /* levels after the last change that was worked off */
static uint32_t polled; /* clock_now() at the last poll */
static uint8_t watched; /* pins whose changes count */
static uint8_t unseen;  /* interrupts since the slot's begin of which no change was seen: pulses too short */

void pin_changes_start(void) {
  head = tail = 0;
  stopped = 0;
  close_row = 0;
  last_time = 0;
  watched = 0;
  unseen = 0;
}

void pin_changes_on_change(uint16_t time, uint8_t port_bits) {
  const uint8_t place = head;
  times[place] = time;
  levels[place] = port_bits;
  const uint8_t next = (uint8_t)(place + 1u) % RING;
  const bool is_full = next == tail;
  if (!is_full) {
    head = next;
  }
  uint8_t row = 1;
  if ((uint16_t)(time - last_time) < CLOSE) {
    row = (uint8_t)(close_row + 1u);
  }
  last_time = time;
  close_row = row;
  if (is_full || row == STORM) {
    close_row = 0;
    stopped = 1;
    hal_watch_port_c(0);
  }
}

/* Those bits of a number below RING that are set where it is DUE or more. */
#define DUE_BITS ((uint8_t)(RING - DUE))
_Static_assert((RING & (RING - 1u)) == 0 && (DUE & (DUE - 1u)) == 0, "powers of two");

uint8_t pin_changes_due(void) {
  const uint8_t waiting = (uint8_t)(head - tail);
  return (uint8_t)(stopped | (waiting & DUE_BITS));
}

static uint8_t wanted(void) { return (uint8_t)(encoder_pins() | light_pins()); }

static void mask(uint8_t pins) {
  encoder_mask(pins);
  light_mask(pins);
}

/* `now` ends with a unit of the encoders' time, so that whole units can be subtracted from it. */
static void work_off(uint16_t time, uint8_t bits, uint32_t now) {
  const uint8_t changed = (uint8_t)(bits ^ before) & watched;
  before = bits;
  if (changed == 0) {
    unseen++;
    if (unseen > UNSEEN_MAX) { /* nobody knows whose */
      mask(watched);
    }
    return;
  }
  const uint16_t age = (uint16_t)((uint16_t)now - time);
  encoder_on_change(changed, bits, (uint16_t)((uint16_t)(now / ENCODER_TIME_UNIT) - age / ENCODER_TIME_UNIT));
  if ((changed & light_pins()) != 0) {
    light_on_pin_change(bits, now - age);
  }
}

/* The pins that changed more than once among the last changes before a stop; if pulses were too short to be seen, all. */
static uint8_t noisy_pins(void) {
  uint8_t once = 0;
  uint8_t often = 0;
  uint8_t place = head;
  uint8_t bits = levels[(uint8_t)(place - 1u) % RING];
  for (uint8_t i = 0; i < STORM; i++) {
    place = (uint8_t)(place - 1u) % RING;
    const uint8_t changed = bits ^ levels[place];
    often |= once & changed;
    once |= changed;
    bits = levels[place];
  }
  return often != 0 ? often : watched;
}

/* What the quiet pins did while all were masked is a change like any other, for which the ring has room: it was emptied. It is
 * looked at with the pins watched again, so that nothing is missed in between. */
static void listen_again(void) {
  mask(noisy_pins() & watched);
  watched = wanted();
  HAL_ATOMIC {
    stopped = 0;
    hal_watch_port_c(watched);
    times[head] = hal_time();
    levels[head] = HAL_PORT_C();
    head = (uint8_t)(head + 1u) % RING;
  }
}

/* Pins that count from now on do so from their present levels. */
static void listen(void) {
  const uint8_t pins = wanted();
  if (pins == watched) {
    return;
  }
  const uint8_t added = pins & (uint8_t)~watched;
  HAL_ATOMIC {
    if (head == tail && !stopped) { /* else at the next poll */
      before = (uint8_t)((before & (uint8_t)~added) | (HAL_PORT_C() & added));
      encoder_set_levels(added, before);
      watched = pins;
      hal_watch_port_c(pins);
    }
  }
}

void pin_changes_poll(void) {
  const bool stop = stopped != 0; /* before the head is read: after a stop no change comes */
  const uint8_t end = head;
  const uint32_t now = clock_now() | (ENCODER_TIME_UNIT - 1u);
  if (now - polled > UINT16_MAX) { /* stamps may be of the time before */
    encoder_lose_time();
  }
  polled = now;
  uint8_t place = tail;
  while (place != end) {
    LOOP_BOUND(RING - 1u);
    const uint16_t time = times[place];
    const uint8_t bits = levels[place];
    place = (uint8_t)(place + 1u) % RING;
    tail = place;
    work_off(time, bits, now);
  }
  if (stop) {
    listen_again();
  }
  listen();
}

void pin_changes_begin_slot(void) {
  pin_changes_poll();
  unseen = 0;
  if (clock_tick_begins()) {
    encoder_mask(wanted() & (uint8_t)~watched); /* those that could not be listened to yet */
    encoder_lift_masks();
    listen();
  }
}
