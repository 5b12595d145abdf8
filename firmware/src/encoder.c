/* encoder.c: see encoder.h. Equations: notes section 1.4 (counts for travel, edge periods for speed). */
#include "encoder.h"

#include "generated/messages.h"
#include "hal/hal.h"
#include "link/parameters.h"
#include "pins.h"
#include "schedule.h"

#define PERIOD_UNIT 256u      /* cycles in 16 us */
#define PERIOD_LONGEST 31250u /* 0.5 s in 16 us */
#define SILENT_TICKS 50u      /* 0.5 s */

#if ENCODER_QUADRATURE
#define LINES 4u
#define PORT_BITS() HAL_PORT_READ(ENCODER_LEFT_A)
static const uint8_t line_bit[LINES] = {1u << ENCODER_LEFT_A_BIT, 1u << ENCODER_LEFT_B_BIT, 1u << ENCODER_RIGHT_A_BIT,
                                        1u << ENCODER_RIGHT_B_BIT};
_Static_assert(PIN_ENCODER_LEFT_A >= 14 && PIN_ENCODER_LEFT_B >= 14 && PIN_ENCODER_RIGHT_A >= 14 &&
                   PIN_ENCODER_RIGHT_B >= 14,
               "encoder lines share the pin-change interrupt of port C");
#else
#define LINES 2u
#define PORT_BITS() HAL_PORT_READ(ENCODER_LEFT)
static const uint8_t line_bit[LINES] = {1u << ENCODER_LEFT_BIT, 1u << ENCODER_RIGHT_BIT};
_Static_assert(PIN_ENCODER_LEFT >= 14 && PIN_ENCODER_RIGHT >= 14,
               "encoder lines share the pin-change interrupt of port C");
#endif
#define LINES_PER_SIDE (LINES / SIDES)

/* Shared with the interrupt. */
typedef struct {
  int16_t count;
  schedule_moment last, previous; /* the last two edges */
} wheel;

static volatile wheel wheels[SIDES];
static volatile uint8_t fired[LINES]; /* edges of the line in this tick */
static volatile uint8_t limit;
static volatile uint8_t watched; /* port bits that may interrupt */
static uint8_t before;           /* port bits at the last interrupt */

/* Main loop only. */
static encoder_reading readings[SIDES];
static int16_t counted[SIDES];
static uint8_t silence[SIDES]; /* ticks since the last edge, at most SILENT_TICKS */

/* Counts one edge of a line; masks the line when it fires too often. */
static inline void count_line(uint8_t line) {
  if (fired[line] >= limit) {
    watched &= (uint8_t)~line_bit[line];
    hal_pin_change_mask(watched);
  }
  fired[line]++;
}

static inline void count_wheel(uint8_t side, int8_t step, schedule_moment now) {
  wheels[side].count = (int16_t)(wheels[side].count + step);
  wheels[side].previous.slot = wheels[side].last.slot;
  wheels[side].previous.offset = wheels[side].last.offset;
  wheels[side].last.slot = now.slot;
  wheels[side].last.offset = now.offset;
}

/* What the change of the port's bits means to one wheel. */
static inline __attribute__((always_inline)) void see_wheel(uint8_t side, uint8_t bits, uint8_t changed,
                                                            schedule_moment now) {
#if ENCODER_QUADRATURE
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
  count_wheel(side, encoder_quadrature_step(from, to), now);
#else
  (void)bits;
  if ((changed & line_bit[side]) != 0) {
    count_line(side);
    count_wheel(side, 1, now);
  }
#endif
}

HAL_INTERRUPT_PIN_CHANGE {
  const schedule_moment now = schedule_moment_at(hal_time());
  const uint8_t bits = PORT_BITS();
  const uint8_t changed = (uint8_t)((bits ^ before) & watched);
  see_wheel(LEFT, bits, changed, now);
  see_wheel(RIGHT, bits, changed, now);
  before = bits;
}

/* Port bits of the lines that count, none if encoders are switched off. */
static uint8_t lines_on(void) {
  uint8_t bits = 0;
  if (parameters_device_on(DEVICES_ENCODERS)) {
    for (uint8_t line = 0; line < LINES; line++) {
      bits = (uint8_t)(bits | line_bit[line]);
    }
  }
  return bits;
}

void encoder_start(void) {
#if ENCODER_QUADRATURE
  HAL_PIN_INPUT(ENCODER_LEFT_A);
  HAL_PIN_INPUT(ENCODER_LEFT_B);
  HAL_PIN_INPUT(ENCODER_RIGHT_A);
  HAL_PIN_INPUT(ENCODER_RIGHT_B);
#else
  HAL_PIN_INPUT(ENCODER_LEFT);
  HAL_PIN_INPUT(ENCODER_RIGHT);
#endif
  for (uint8_t side = LEFT; side < SIDES; side++) {
    wheels[side].count = 0;
    counted[side] = 0;
    silence[side] = SILENT_TICKS;
    readings[side] = (encoder_reading){0, 0, false};
  }
  for (uint8_t line = 0; line < LINES; line++) {
    fired[line] = 0;
  }
  limit = (uint8_t)parameters_get(PARAMETER_ENCODER_LIMIT);
  before = PORT_BITS();
  watched = lines_on();
  hal_pin_change_mask(watched);
}

/* The time between two edges in 16 us, 0 if it is 0.5 s or more. */
static uint16_t period_of(schedule_moment from, schedule_moment to) {
  const uint32_t units = (uint32_t)schedule_between(from, to) / PERIOD_UNIT;
  return units == 0 ? 1u : units >= PERIOD_LONGEST ? 0u : (uint16_t)units;
}

/* Edges of a wheel's lines in the tick that ends; whether one of them was masked. */
static uint16_t close_tick(uint8_t side, bool *masked) {
  uint16_t edges = 0;
  *masked = false;
  for (uint8_t line = (uint8_t)(side * LINES_PER_SIDE); line < (side + 1u) * LINES_PER_SIDE; line++) {
    const uint8_t count = fired[line];
    fired[line] = 0;
    *masked = *masked || count > limit;
    edges = (uint16_t)(edges + count);
  }
  return edges;
}

static void update_reading(uint8_t side) {
  encoder_reading *reading = &readings[side];
  wheel now;
  uint16_t edges = 0;
  HAL_ATOMIC {
    now.count = wheels[side].count;
    now.last.slot = wheels[side].last.slot;
    now.last.offset = wheels[side].last.offset;
    now.previous.slot = wheels[side].previous.slot;
    now.previous.offset = wheels[side].previous.offset;
    edges = close_tick(side, &reading->masked);
  }
  reading->count += (int16_t)(now.count - counted[side]);
  counted[side] = now.count;
  if (edges != 0) {
    const bool paired = edges >= 2 || silence[side] < SILENT_TICKS;
    reading->period = paired ? period_of(now.previous, now.last) : 0;
    silence[side] = 0;
  } else if (silence[side] < SILENT_TICKS) {
    silence[side]++;
  } else {
    reading->period = 0;
  }
}

void encoder_task(void) {
  update_reading(LEFT);
  update_reading(RIGHT);
  const uint8_t lines = lines_on();
  const uint8_t new_limit = (uint8_t)parameters_get(PARAMETER_ENCODER_LIMIT);
  HAL_ATOMIC {
    /* Lines that come back begin at their present level; the others may have an edge that waits to be counted. */
    before = (uint8_t)((before & watched) | (PORT_BITS() & (uint8_t)~watched));
    watched = lines;
    limit = new_limit;
    hal_pin_change_mask(lines);
  }
}

const encoder_reading *encoder_read(uint8_t side) { return &readings[side]; }
