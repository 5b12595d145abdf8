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

/* Noise is blamed on the lines that did this much of it. */
#define SHARE_OF_STORM 2u /* of at least HAL_CHANGES_STORM changes in 0.05 ms */
#define SHARE_OF_RING 8u  /* of the ring's changes */

/* Main loop only. */
typedef struct {
  uint32_t last, previous; /* schedule_now() of the last two edges */
  uint16_t edges;          /* in this tick, all lines */
  uint8_t silence;         /* ticks since the last edge, at most SILENT_TICKS */
  encoder_reading reading;
  int32_t count;
} wheel;

static wheel wheels[SIDES];
static uint8_t fired[LINES]; /* edges of the line in this tick */
static uint8_t before;       /* port bits of the last change worked off */
static uint8_t watched;      /* port bits of the lines that count */
static uint8_t limit;        /* edges of a line in a tick above which it is masked */
static uint8_t phantoms;     /* interrupts of this tick without a change to be seen: pulses too short */
static uint8_t awaited;      /* port bit of the other line whose change is awaited, or 0 */
static uint8_t other_bit;    /* the same, also when it has come */
static bool other_seen;      /* it has come, */
static uint32_t other_edge;  /* at that schedule_now() */

/* Lets the lines that count interrupt, unless the interrupt has just masked them. */
static void listen(void) {
  HAL_ATOMIC {
    if (!hal_changes_stopped()) {
      hal_pin_change_mask(watched | awaited);
    }
  }
}

void encoder_await_other(uint8_t bit) {
  encoder_poll();
  other_seen = false;
  awaited = other_bit = bit;
  before = (uint8_t)((before & (uint8_t)~bit) | (PORT_BITS() & bit));
  listen();
}

bool encoder_saw_other(void) { return other_seen; }

uint32_t encoder_other_edge(void) { return other_edge; }

/* The edge that was awaited: the line is masked again. */
static __attribute__((noinline)) void see_other(uint32_t time) {
  awaited = 0;
  other_seen = true;
  other_edge = time;
  listen();
}

static __attribute__((noinline)) void mask_line(uint8_t line) {
  watched = (uint8_t)(watched & (uint8_t)~line_bit[line]);
  listen();
}

/* Counts one edge of a line; masks the line when it fires too often. */
static inline __attribute__((always_inline)) void count_line(uint8_t line) {
  if (fired[line] >= limit) {
    mask_line(line);
  }
  fired[line]++;
}

static void count_wheel(wheel *w, int8_t step, uint32_t time) {
  w->count += step;
  w->edges++;
  w->previous = w->last;
  w->last = time;
}

/* What a change of the port means to one wheel. Inlined for each side, so that the bits are constants. */
static inline __attribute__((always_inline)) void see_wheel(uint8_t side, uint8_t bits, uint8_t changed,
                                                            uint32_t time) {
#if ENCODER_LINES == 2
  const uint8_t a = line_bit[2u * side];
  const uint8_t b = line_bit[2u * side + 1u];
  if ((changed & (a | b)) == 0) {
    return;
  }
  if ((changed & a) != 0) {
    count_line((uint8_t)(2u * side));
  }
  if ((changed & b) != 0) {
    count_line((uint8_t)(2u * side + 1u));
  }
  const uint8_t from = (uint8_t)(((before & a) != 0 ? 2u : 0u) | ((before & b) != 0 ? 1u : 0u));
  const uint8_t to = (uint8_t)(((bits & a) != 0 ? 2u : 0u) | ((bits & b) != 0 ? 1u : 0u));
  count_wheel(&wheels[side], encoder_quadrature_step(from, to), time);
#else
  (void)bits;
  if ((changed & line_bit[side]) != 0) {
    count_line(side);
    count_wheel(&wheels[side], 1, time);
  }
#endif
}

/* In line in the loop that takes every change. */
static inline __attribute__((always_inline)) void work_off(uint8_t bits, uint32_t time) {
  const uint8_t changed = (uint8_t)((bits ^ before) & watched);
  if (changed == 0) {
    phantoms = (uint8_t)(phantoms + (bits == before && phantoms < 255u));
  } else {
    see_wheel(LEFT, bits, changed, time);
    see_wheel(RIGHT, bits, changed, time);
  }
  if (((bits ^ before) & awaited) != 0) {
    see_other(time);
  }
  before = bits;
}

/* Masks lines until the next tick and has them reported. */
static void convict(uint8_t lines) {
  BOUNDED(LINES, for (uint8_t line = 0; line < LINES; line++)) {
    if ((lines & line_bit[line]) != 0) {
      fired[line] = (uint8_t)(limit + 1u);
    }
  }
  watched = (uint8_t)(watched & (uint8_t)~lines);
  listen();
}

/* The lines whose noise stopped the interrupt, from the changes up to `head`. The other line is told from them like one of
 * theirs, and gets no mask: it is awaited no more. */
static uint8_t noisy_lines(uint8_t head) {
  uint8_t at = (uint8_t)(head - HAL_CHANGE_BYTES);
  const uint8_t run = hal_change_after(at)->close;
  const bool storm = run >= HAL_CHANGES_STORM;
  const uint8_t share = storm ? SHARE_OF_STORM : SHARE_OF_RING;
  uint8_t left = storm && run < HAL_CHANGES - 2u ? run : HAL_CHANGES - 2u;
  uint8_t edges[LINES] = {0};
  uint8_t other_edges = 0;
  uint8_t lines = 0;
  uint8_t bits = hal_change_after(at)->bits;
  BOUNDED(HAL_CHANGES - 2u, for (; left > 0; left--)) {
    at = (uint8_t)(at - HAL_CHANGE_BYTES);
    const uint8_t earlier = hal_change_after(at)->bits;
    BOUNDED(LINES, for (uint8_t line = 0; line < LINES; line++)) {
      if (((bits ^ earlier) & line_bit[line]) != 0 && ++edges[line] >= share) {
        lines |= line_bit[line];
      }
    }
    other_edges = (uint8_t)(other_edges + (((bits ^ earlier) & other_bit) != 0));
    bits = earlier;
  }
  lines &= watched;
  return lines != 0 || other_edges >= share ? lines : watched;
}

/* After a stop: masks the noise and listens to the rest. */
static __attribute__((noinline)) void go_on(uint8_t head) {
  const uint8_t lines = noisy_lines(head);
  awaited = 0;
  hal_changes_resume();
  convict(lines);
  work_off(PORT_BITS(), schedule_now()); /* what the others did meanwhile */
}

void encoder_poll(void) {
  const bool stopped = hal_changes_stopped(); /* before the head is read: no change comes after it */
  uint8_t tail = hal_changes_tail;
  const uint8_t head = hal_changes_head; /* before the time is read: every change up to it is in the past */
  if (tail != head) {
    const uint32_t now = schedule_now();
    /* Equal indices are an empty ring: it holds one change less than it has places. */
    BOUNDED(HAL_CHANGES - 1u, while (tail != head)) {
      const volatile hal_change *oldest = hal_change_after(tail);
      const uint16_t age = (uint16_t)((uint16_t)now - oldest->time);
      const uint8_t bits = oldest->bits;
      tail = (uint8_t)(tail + HAL_CHANGE_BYTES);
      hal_changes_tail = tail;
      work_off(bits, now - age);
    }
    if (phantoms > limit) { /* nobody knows whose */
      convict(watched);
      phantoms = 0;
    }
  }
  if (stopped) {
    go_on(head);
  }
}

/* Port bits of the lines that count, none if encoders are switched off. */
static uint8_t lines_on(void) {
  return parameters_device_on(DEVICES_ENCODERS) ? (uint8_t)(SIDE_BITS(LEFT) | SIDE_BITS(RIGHT)) : 0u;
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
  HAL_ZERO(phantoms);
  HAL_ZERO(awaited);
  HAL_ZERO(other_bit);
  HAL_ZERO(other_seen);
  BOUNDED(SIDES, for (uint8_t side = LEFT; side < SIDES; side++)) {
    wheels[side] = (wheel){.silence = SILENT_TICKS};
  }
  HAL_ZERO(fired);
  limit = (uint8_t)parameters_u16(PARAMETER_ENCODER_LIMIT);
  before = PORT_BITS();
  watched = lines_on();
  listen();
}

/* The time between two edges in 16 us, 0 if it is 0.5 s or more. */
static uint16_t period_of(uint32_t from, uint32_t to) {
  const uint32_t units = (to - from) / PERIOD_UNIT;
  return units == 0 ? 1u : units >= PERIOD_LONGEST ? 0u : (uint16_t)units;
}

/* Makes the reading of a wheel from the tick that ends. */
static void close_wheel(uint8_t side) {
  wheel *w = &wheels[side];
  w->reading.count = w->count;
  if (w->edges != 0) {
    /* After a long silence the edge before the first is too old for its stamp to tell. */
    w->reading.period = w->edges >= 2 || w->silence < SILENT_TICKS ? period_of(w->previous, w->last) : 0u;
    w->silence = 0;
  } else if (w->silence < SILENT_TICKS) {
    w->silence++;
  } else {
    w->reading.period = 0;
  }
  w->edges = 0;
  w->reading.masked = false;
  BOUNDED(LINES_PER_SIDE, for (uint8_t i = 0; i < LINES_PER_SIDE; i++)) {
    uint8_t *count = &fired[(uint8_t)(side * LINES_PER_SIDE + i)];
    w->reading.masked = w->reading.masked || *count > limit;
    *count = 0;
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
  encoder_poll();
  close_wheel(LEFT);
  close_wheel(RIGHT);
  limit = (uint8_t)parameters_u16(PARAMETER_ENCODER_LIMIT);
  const uint8_t lines = lines_on();
  const uint8_t back = (uint8_t)(lines & (uint8_t)~watched); /* these begin at their present level */
  before = (uint8_t)((before & (uint8_t)~back) | (PORT_BITS() & back));
  watched = lines;
  forget_gap(LEFT, back, lines);
  forget_gap(RIGHT, back, lines);
  phantoms = 0;
  listen();
}

const encoder_reading *encoder_read(uint8_t side) { return &wheels[side].reading; }
