/* encoder.c: see encoder.h. Equations: notes section 1.4 (counts for travel, edge periods for speed). */
#include "encoder.h"

#include "bounds.h"
#include "generated/messages.h"
#include "hal/hal.h"
#include "link/parameters.h"
#include "pins.h"
#include "schedule.h"

#define PERIOD_UNIT 256u      /* cycles in 16 us */
#define PERIOD_LONGEST 31250u /* 0.5 s in 16 us */
#define SILENT_TICKS 50u      /* 0.5 s */

#if ENCODER_LINES == 2
#define LINES_PER_SIDE 2u
#define SIDE_BITS(side) (line_bit[2u * (side)] | line_bit[2u * (side) + 1u])
static const uint8_t line_bit[LINES_PER_SIDE * SIDES] = {1u << ENCODER_LEFT_A_BIT, 1u << ENCODER_LEFT_B_BIT,
                                                         1u << ENCODER_RIGHT_A_BIT, 1u << ENCODER_RIGHT_B_BIT};
_Static_assert(PIN_ENCODER_LEFT_A >= 14 && PIN_ENCODER_LEFT_B >= 14 && PIN_ENCODER_RIGHT_A >= 14 &&
                   PIN_ENCODER_RIGHT_B >= 14,
               "encoder lines share the pin-change interrupt of port C");
#else
#define LINES_PER_SIDE 1u
#define SIDE_BITS(side) (line_bit[side])
#if ENCODER_LINES == 1
static const uint8_t line_bit[LINES_PER_SIDE * SIDES] = {1u << ENCODER_LEFT_BIT, 1u << ENCODER_RIGHT_BIT};
_Static_assert(PIN_ENCODER_LEFT >= 14 && PIN_ENCODER_RIGHT >= 14,
               "encoder lines share the pin-change interrupt of port C");
#else /* wheels without encoders: none of the port's bits is theirs */
static const uint8_t line_bit[LINES_PER_SIDE * SIDES] = {0, 0};
#endif
#endif
#define PORT_BITS() HAL_PORT_C()

#define LINES (LINES_PER_SIDE * SIDES)
#define ANY_LINES (ENCODER_LINES != 0)

/* The lines of one wheel among bits of the port. `side` is a constant; neighbours are but shifted. */
enum { A = 1, B = 2 };
static inline __attribute__((always_inline)) uint8_t lines_of(uint8_t side, uint8_t bits) {
#if ENCODER_LINES == 2
  const uint8_t a = line_bit[2u * side];
  const uint8_t b = line_bit[2u * side + 1u];
  return b == (uint8_t)(a << 1) ? (uint8_t)(bits / a & (A | B))
                                : (uint8_t)(((bits & a) != 0 ? A : 0u) | ((bits & b) != 0 ? B : 0u));
#else
  return (bits & line_bit[side]) != 0 ? A : 0u;
#endif
}

/* The port's other line whose fall can be awaited: the left light sensor's, where there is one. */
#ifdef PIN_LIGHT_LEFT
#define OTHER_BIT HAL_PIN_BIT(LIGHT_LEFT)
#else
#define OTHER_BIT 0u
#endif

/* Noise is blamed on the lines that did this much of the last changes. */
#define LOOKED_AT 16u
#define SHARE_OF_STORM 2u /* of at least HAL_CHANGES_STORM changes in 0.05 ms */
#define SHARE_OF_RING 4u  /* of LOOKED_AT */

/* Main loop only. Stamps are hal_time(), and become schedule_now() in encoder_update(). */
typedef struct {
  uint16_t stamp, stamp_before; /* of the last two edges */
  uint8_t stamped;              /* edges since encoder_update(), at most a line's limit; of two lines a bit for each */
#if ENCODER_LINES == 2
  int16_t steps; /* and by how much they change the count, at most by both lines' limits */
#endif
  uint8_t edges;                /* in this tick, at most 2 */
  uint8_t silence;              /* ticks since the last edge, at most SILENT_TICKS */
  uint8_t left[LINES_PER_SIDE]; /* edges of the line in this tick after which it is masked; 0: it is */
  uint32_t last, gap;           /* time of the last edge, and since the edge before */
  int32_t count;
  encoder_reading reading;
} wheel;

static wheel wheels[SIDES];
static uint8_t before;    /* port bits of the last change worked off */
static uint8_t watched;   /* port bits of the lines that count */
static uint8_t returning; /* port bits of those that do again as soon as take_back() can */
static uint8_t phantoms;  /* the same as a line's `left`, of interrupts without a change to be seen: pulses too short */

/* The fall of the other line: */
static enum { NOT_AWAITED, AWAITED, STAMPED, SEEN } other;
static uint16_t other_stamp;
static uint32_t other_from; /* what came before that schedule_now() does not count */
static uint32_t other_edge;

/* Lets the lines that count interrupt, unless the interrupt has just masked them. */
static __attribute__((noinline)) void listen(void) {
  const uint8_t lines = (uint8_t)(watched | (other == AWAITED ? OTHER_BIT : 0u));
  HAL_ATOMIC {
    if (!hal_changes_stopped()) {
      hal_pin_change_mask(lines);
    }
  }
}

void encoder_await_other(void) {
  other_from = schedule_now();
  other = AWAITED;
  before |= OTHER_BIT;
  listen();
}

void encoder_forget_other(void) {
  other = NOT_AWAITED;
  listen();
}

bool encoder_awaits_other(void) { return other == AWAITED || other == STAMPED; }

bool encoder_saw_other(void) { return other == SEEN; }

uint32_t encoder_other_edge(void) { return other_edge; }

/* It has come: the line is masked again. */
static __attribute__((noinline)) void see_other(uint16_t time) {
  other = STAMPED;
  other_stamp = time;
  listen();
}

/* Masks lines until the next tick and has them reported. */
static __attribute__((noinline)) void convict(uint8_t lines) {
  BOUNDED(SIDES, for (uint8_t side = LEFT; side < SIDES; side++)) {
    BOUNDED(LINES_PER_SIDE, for (uint8_t i = 0; i < LINES_PER_SIDE; i++)) {
      if ((lines & line_bit[side * LINES_PER_SIDE + i]) != 0) {
        wheels[side].left[i] = 0;
      }
    }
  }
  watched = (uint8_t)(watched & (uint8_t)~lines);
  listen();
}

/* Masks the lines that have fired too often in this tick. */
static __attribute__((noinline)) void keep_limit(void) {
  uint8_t lines = 0;
  BOUNDED(SIDES, for (uint8_t side = LEFT; side < SIDES; side++)) {
    BOUNDED(LINES_PER_SIDE, for (uint8_t i = 0; i < LINES_PER_SIDE; i++)) {
      if (wheels[side].left[i] == 0) {
        lines |= line_bit[side * LINES_PER_SIDE + i];
      }
    }
  }
  if (phantoms == 0) { /* nobody knows whose */
    lines = watched;
  }
  convict(lines);
}

/* What a change of the port means to one wheel, of whose lines `changed` have changed and `bits` are high. Forward are the
 * edges of A after which the lines differ and those of B after which they do not; an edge of both is a step of 0, and the
 * limit of A leaves its last edge to one of A alone. */
static __attribute__((noinline)) void see_wheel(wheel *w, uint8_t changed, uint8_t bits, uint16_t time) {
  w->stamp_before = w->stamp;
  w->stamp = time;
  uint8_t *left = &w->left[0];
#if ENCODER_LINES == 2
  w->stamped = (uint8_t)(2u * w->stamped | 1u);
  if (changed == (A | B)) {
    if (*left > 1u) {
      --*left;
    }
  } else if (((bits ^ bits >> 1 ^ changed) & A) == 0) {
    w->steps++;
  } else {
    w->steps--;
  }
  if ((changed & B) != 0) {
    left++;
  }
#else
  w->stamped++;
  (void)changed, (void)bits;
#endif
  if (--*left == 0) {
    keep_limit();
  }
}

/* Adds the edges of each line between two changes. The other line is told from them like one of theirs. */
static inline __attribute__((always_inline)) void add_edges(uint8_t edges[LINES + 1u], uint8_t changed) {
  BOUNDED(LINES, for (uint8_t line = 0; line < LINES; line++)) {
    edges[line] = (uint8_t)(edges[line] + ((changed & line_bit[line]) != 0));
  }
  edges[LINES] = (uint8_t)(edges[LINES] + ((changed & OTHER_BIT) != 0));
}

/* The lines whose noise stopped the interrupt, from the last changes up to `head`: those that did their share of it; if
 * pulses too short to be seen leave none, those that did most. The other line gets no mask: it is awaited no more. */
static uint8_t noisy_lines(uint8_t head) {
  uint8_t at = (uint8_t)(head - HAL_CHANGE_BYTES);
  const uint8_t run = hal_change_after(at)->close;
  const bool storm = run >= HAL_CHANGES_STORM;
  uint8_t edges[LINES + 1u] = {0};
  uint8_t bits = hal_change_after(at)->bits;
  BOUNDED(LOOKED_AT, for (uint8_t left = storm && run < LOOKED_AT ? run : LOOKED_AT; left > 0; left--)) {
    at = (uint8_t)(at - HAL_CHANGE_BYTES);
    const uint8_t earlier = hal_change_after(at)->bits;
    add_edges(edges, bits ^ earlier);
    bits = earlier;
  }
  uint8_t lines = 0;
  BOUNDED(SHARE_OF_RING + 1u, for (uint8_t share = storm ? SHARE_OF_STORM : SHARE_OF_RING; lines == 0; share--)) {
    BOUNDED(LINES, for (uint8_t line = 0; line < LINES; line++)) {
      if (edges[line] >= share) {
        lines |= line_bit[line] & watched;
      }
    }
    if (edges[LINES] >= share) { /* none of them, or all of none */
      break;
    }
  }
  return lines;
}

/* After a stop: masks the noise and listens to the rest. What the others did meanwhile is a change like any other, with
 * room in the ring, which is empty. It is looked at when the interrupt already listens: an edge in between would be seen
 * by neither, and the next one, back to the level before, would not be one. */
static __attribute__((noinline)) void go_on(uint8_t head) {
  const uint8_t lines = noisy_lines(head);
  volatile hal_change *const missed = hal_change_after(head);
  missed->time = (uint16_t)schedule_now();
  missed->close = 0;
  other = NOT_AWAITED;
  hal_changes_resume();
  HAL_ATOMIC {
    hal_pin_change_mask((uint8_t)(watched & (uint8_t)~lines));
    missed->bits = PORT_BITS();
    hal_changes_head = (uint8_t)(head + HAL_CHANGE_BYTES);
  }
  convict(lines);
}

/* Lines that were masked count again, from their present level on; as long as changes wait, which show their noise, later. */
static __attribute__((noinline)) void take_back(void) {
  const uint8_t tail = hal_changes_tail;
  HAL_ATOMIC {
    if (hal_changes_head == tail) {
      before = (uint8_t)((before & (uint8_t)~returning) | (PORT_BITS() & returning));
      watched |= returning;
      returning = 0;
    }
  }
  listen();
}

void encoder_poll(void) {
  const uint8_t stopped = hal_changes_stopped(); /* before the head is read: no change comes after it */
  const uint8_t head = hal_changes_head;
  uint8_t tail = hal_changes_tail;
  uint8_t was = before;
  BOUNDED(HAL_CHANGES - 1u, while (tail != head)) {
    const volatile hal_change *const change = hal_change_after(tail);
    const uint16_t time = change->time;
    const uint8_t bits = change->bits;
    tail = (uint8_t)(tail + HAL_CHANGE_BYTES);
    hal_changes_tail = tail;
    const uint8_t changed = bits ^ was;
    if (changed == 0) {
      if (--phantoms == 0) {
        keep_limit();
      }
      continue;
    }
    const uint8_t edges = changed & watched;
    if ((edges & SIDE_BITS(LEFT)) != 0) {
      see_wheel(&wheels[LEFT], lines_of(LEFT, edges), lines_of(LEFT, bits), time);
    }
    if ((edges & SIDE_BITS(RIGHT)) != 0) {
      see_wheel(&wheels[RIGHT], lines_of(RIGHT, edges), lines_of(RIGHT, bits), time);
    }
    if ((changed & was & OTHER_BIT) != 0 && other == AWAITED) {
      see_other(time);
    }
    was = bits;
  }
  before = was;
  if (stopped) {
    go_on(head);
  }
  if (returning != 0) {
    take_back();
  }
}

/* The schedule_now() of a stamp: not later than `now`, and less than 2^16 cycles before it. */
static uint32_t time_of(uint16_t stamp, uint32_t now) { return now - (uint16_t)((uint16_t)now - stamp); }

static __attribute__((noinline)) void update_wheel(wheel *w, uint32_t now) {
  if (w->stamped == 0) {
    return;
  }
  const uint32_t last = time_of(w->stamp, now);
  w->gap = w->stamped >= 2 ? (uint16_t)(w->stamp - w->stamp_before) : last - w->last;
  w->last = last;
#if ENCODER_LINES == 2
  w->count += w->steps;
  w->steps = 0;
#else
  w->count += w->stamped;
#endif
  w->edges = w->edges == 0 && w->stamped == 1 ? 1u : 2u;
  w->stamped = 0;
}

void encoder_update(void) {
  encoder_poll();
  const uint32_t now = schedule_now();
  if (ANY_LINES) {
    update_wheel(&wheels[LEFT], now);
    update_wheel(&wheels[RIGHT], now);
  }
  if (OTHER_BIT != 0 && other == STAMPED) {
    other_edge = time_of(other_stamp, now);
    other = (int32_t)(other_edge - other_from) >= 0 ? SEEN : AWAITED;
    listen();
  }
}

/* Port bits of the lines that count, none if encoders are switched off. */
static uint8_t lines_on(void) {
  return parameters_device_on(DEVICES_ENCODERS) ? (uint8_t)(SIDE_BITS(LEFT) | SIDE_BITS(RIGHT)) : 0u;
}

/* Each line may make as many edges again as the parameter allows; one more masks it. */
static void begin_tick(void) {
  const uint8_t edges = (uint8_t)(parameters_u16(PARAMETER_ENCODER_LIMIT) + 1u);
  phantoms = edges;
  BOUNDED(SIDES, for (uint8_t side = LEFT; side < SIDES; side++)) {
    BOUNDED(LINES_PER_SIDE, for (uint8_t i = 0; i < LINES_PER_SIDE; i++)) {
      wheels[side].left[i] = edges;
    }
  }
}

void encoder_start(void) {
#if ENCODER_LINES == 2
  HAL_PIN_INPUT(ENCODER_LEFT_A);
  HAL_PIN_INPUT(ENCODER_LEFT_B);
  HAL_PIN_INPUT(ENCODER_RIGHT_A);
  HAL_PIN_INPUT(ENCODER_RIGHT_B);
#elif ENCODER_LINES == 1
  HAL_PIN_INPUT(ENCODER_LEFT);
  HAL_PIN_INPUT(ENCODER_RIGHT);
#endif
  HAL_ZERO(hal_changes_head);
  HAL_ZERO(hal_changes_tail);
  hal_changes_resume();
  HAL_ZERO(returning);
  HAL_ZERO(other);
  BOUNDED(SIDES, for (uint8_t side = LEFT; side < SIDES; side++)) {
    wheels[side] = (wheel){.silence = SILENT_TICKS};
  }
  begin_tick();
  before = PORT_BITS();
  hal_change_at(0)->bits = before; /* the change before the first one; the start-up code has not made the ring zero */
  hal_change_at(0)->close = 0;
  watched = lines_on();
  listen();
}

/* A time between two edges in 16 us, 0 if it is 0.5 s or more. */
static uint16_t period_of(uint32_t gap) {
  const uint32_t units = gap / PERIOD_UNIT;
  return units == 0 ? 1u : units >= PERIOD_LONGEST ? 0u : (uint16_t)units;
}

/* Makes the reading of a wheel from the tick that ends. */
static void close_wheel(uint8_t side) {
  wheel *w = &wheels[side];
  w->reading.count = w->count;
  if (w->edges != 0) {
    /* After a long silence the edge before the first is too old for its stamp to tell. */
    w->reading.period = w->edges >= 2 || w->silence < SILENT_TICKS ? period_of(w->gap) : 0u;
    w->silence = 0;
  } else if (w->silence < SILENT_TICKS) {
    w->silence++;
  } else {
    w->reading.period = 0;
  }
  w->edges = 0;
  w->reading.masked = (returning & SIDE_BITS(side)) != 0; /* it has not come back in the whole tick */
  BOUNDED(LINES_PER_SIDE, for (uint8_t i = 0; i < LINES_PER_SIDE; i++)) {
    if (w->left[i] == 0) {
      w->reading.masked = true;
    }
  }
  if (w->reading.masked) {
    w->reading.period = 0;
  }
}

/* What a line does that did not count says nothing about the time to its next edge. */
static void forget_gap(uint8_t side, uint8_t back, uint8_t lines) {
  if ((back & SIDE_BITS(side)) != 0 || (lines & SIDE_BITS(side)) == 0) {
    wheels[side].silence = SILENT_TICKS;
  }
}

void encoder_task(void) {
  if (ANY_LINES) {
    close_wheel(LEFT);
    close_wheel(RIGHT);
  }
  begin_tick();
  if (!ANY_LINES) {
    return;
  }
  const uint8_t lines = lines_on();
  returning = (uint8_t)(lines & (uint8_t)~watched);
  forget_gap(LEFT, returning, lines);
  forget_gap(RIGHT, returning, lines);
  watched &= lines;
  take_back();
}

const encoder_reading *encoder_read(uint8_t side) { return &wheels[side].reading; }
