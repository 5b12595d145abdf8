/* avr_timers.c: timer/counters 0, 1 and 2 in all their counting modes (15 to 18), computed, not stepped.
 *
 * A timer walks round a lap: 0 up to its top, in the phase-correct modes on down to 0 again. `position` is where it
 * was at cycle `known`; every later place follows from the prescaler. What can happen at the count that leaves a place
 * (compare match, overflow, end of the lap) is found by its distance; the timer is due only for what somebody waits for:
 * an enabled flag that is not yet set, or an output pin. Everything else is computed when a register is touched.
 *
 * A match with OCRn sets its flag, and moves its pin, one count after the count became equal (16.7.1). The compare
 * registers are double-buffered in the PWM modes. The prescalers run freely (17). External clocks are not built: such
 * a timer stands still.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#include "avr_parts.h"

enum { CONTROL_A, CONTROL_B, CONTROL_C };                      /* TCCRnA, TCCRnB, TCCR1C follow each other */
enum { ACTION_NONE, ACTION_TOGGLE, ACTION_CLEAR, ACTION_SET }; /* COMnx */

#define REG_ICR1L 0x86
#define CAPTURE_ON_RISE 0x40u /* TCCR1B.ICES1 */

typedef struct {
  uint8_t mode, top_from;
  uint16_t fixed_top;
} waveform;

/* By WGM02:0 and WGM22:0 (table 15-8, 18-8); by WGM13:0 (table 16-4). */
static const waveform NARROW[8] = {
    {COUNT_NORMAL, TOP_FIXED, 0xFF},   {COUNT_PHASE_PWM, TOP_FIXED, 0xFF}, {COUNT_CLEAR_ON_MATCH, TOP_OCRA, 0},
    {COUNT_FAST_PWM, TOP_FIXED, 0xFF}, {COUNT_NORMAL, TOP_FIXED, 0xFF},    {COUNT_PHASE_PWM, TOP_OCRA, 0},
    {COUNT_NORMAL, TOP_FIXED, 0xFF},   {COUNT_FAST_PWM, TOP_OCRA, 0},
};
static const waveform WIDE[16] = {
    {COUNT_NORMAL, TOP_FIXED, 0xFFFF},
    {COUNT_PHASE_PWM, TOP_FIXED, 0xFF},
    {COUNT_PHASE_PWM, TOP_FIXED, 0x1FF},
    {COUNT_PHASE_PWM, TOP_FIXED, 0x3FF},
    {COUNT_CLEAR_ON_MATCH, TOP_OCRA, 0},
    {COUNT_FAST_PWM, TOP_FIXED, 0xFF},
    {COUNT_FAST_PWM, TOP_FIXED, 0x1FF},
    {COUNT_FAST_PWM, TOP_FIXED, 0x3FF},
    {COUNT_PHASE_FREQUENCY_PWM, TOP_ICR, 0},
    {COUNT_PHASE_FREQUENCY_PWM, TOP_OCRA, 0},
    {COUNT_PHASE_PWM, TOP_ICR, 0},
    {COUNT_PHASE_PWM, TOP_OCRA, 0},
    {COUNT_CLEAR_ON_MATCH, TOP_ICR, 0},
    {COUNT_NORMAL, TOP_FIXED, 0xFFFF},
    {COUNT_FAST_PWM, TOP_ICR, 0},
    {COUNT_FAST_PWM, TOP_OCRA, 0},
};

static const uint16_t DIVIDERS[8] = {0, 1, 8, 64, 256, 1024, 0, 0};
static const uint16_t DIVIDERS_OF_2[8] = {0, 1, 8, 32, 64, 128, 256, 1024};

static const timer_state BUILT_IN[3] = {
    {.number = 0,
     .source = DUE_TIMER0,
     .address_control_a = 0x44,
     .address_count = 0x46,
     .address_compare = {0x47, 0x48},
     .address_mask = 0x6E,
     .vector_overflow = VECTOR_TIMER0_OVF,
     .vector_compare = {VECTOR_TIMER0_COMPA, VECTOR_TIMER0_COMPB},
     .output_port = {PORT_D, PORT_D},
     .output_bit = {6, 5},
     .dividers = DIVIDERS,
     .maximum = 0xFF},
    {.number = 1,
     .source = DUE_TIMER1,
     .address_control_a = 0x80,
     .address_count = 0x84,
     .address_compare = {0x88, 0x8A},
     .address_mask = 0x6F,
     .vector_overflow = VECTOR_TIMER1_OVF,
     .vector_compare = {VECTOR_TIMER1_COMPA, VECTOR_TIMER1_COMPB},
     .output_port = {PORT_B, PORT_B},
     .output_bit = {1, 2},
     .dividers = DIVIDERS,
     .maximum = 0xFFFF},
    {.number = 2,
     .source = DUE_TIMER2,
     .address_control_a = 0xB0,
     .address_count = 0xB2,
     .address_compare = {0xB3, 0xB4},
     .address_mask = 0x70,
     .vector_overflow = VECTOR_TIMER2_OVF,
     .vector_compare = {VECTOR_TIMER2_COMPA, VECTOR_TIMER2_COMPB},
     .output_port = {PORT_B, PORT_D},
     .output_bit = {3, 3},
     .dividers = DIVIDERS_OF_2,
     .maximum = 0xFF},
};

/* ---- the lap ---- */

static bool counts_down(const timer_state *t) {
  return t->mode == COUNT_PHASE_PWM || t->mode == COUNT_PHASE_FREQUENCY_PWM;
}

static bool is_buffered(const timer_state *t) { return t->mode >= COUNT_FAST_PWM; }

static uint32_t top_of(const timer_state *t) {
  switch (t->top_from) {
    case TOP_OCRA:
      return t->compare[0];
    case TOP_ICR:
      return t->capture;
    default:
      return t->fixed_top;
  }
}

/* Places in the present lap. A timer that is beyond its top goes on to its maximum. */
static uint32_t lap_of(const timer_state *t) {
  uint32_t top = top_of(t);
  if (counts_down(t)) return top ? 2 * top : 1;
  return t->position > top ? t->maximum + 1 : top + 1;
}

static uint32_t count_of(const timer_state *t) {
  uint32_t top = top_of(t);
  return counts_down(t) && t->position > top ? 2 * top - t->position : t->position;
}

static void set_count(timer_state *t, uint32_t count) {
  uint32_t top = top_of(t);
  t->position = counts_down(t) && count > top ? top : count;
  if (counts_down(t) && t->position >= lap_of(t)) t->position = 0; /* top 0: there is but one place */
}

/* Where a compare value is met: on the way up, and on the way down. */
static uint32_t place_up(const timer_state *t, int channel) { return t->compare[channel]; }
static uint32_t place_down(const timer_state *t, int channel) {
  uint32_t top = top_of(t), compare = t->compare[channel];
  return compare > 0 && compare < top ? 2 * top - compare : compare;
}

/* The place that is left when the buffered compare values come into force (table 15-8, 16-4). */
static uint32_t place_of_update(const timer_state *t) {
  if (t->mode == COUNT_PHASE_PWM && top_of(t) > 0) return top_of(t) - 1; /* TOP is reached */
  return lap_of(t) - 1;
}

/* ---- distances ---- */

/* Counts until `place` is left; 1: by the next. */
static uint64_t distance(const timer_state *t, uint32_t place) {
  uint32_t lap = lap_of(t);
  if (place >= t->position && place < lap) return (uint64_t)place - t->position + 1;
  uint32_t following = counts_down(t) ? lap : top_of(t) + 1;
  if (place >= following) return NEVER;
  return (uint64_t)lap - t->position + place + 1;
}

/* The same for a compare match, which a write to the count holds off once. */
static uint64_t match_distance(const timer_state *t, uint32_t place) {
  uint64_t d = distance(t, place);
  if (d != 1 || !t->match_blocked) return d;
  uint32_t following = counts_down(t) ? lap_of(t) : top_of(t) + 1;
  return place < following ? lap_of(t) + d : NEVER;
}

static uint64_t nearer(uint64_t a, uint64_t b) { return a < b ? a : b; }

static bool buffer_is_waiting(const timer_state *t) {
  return t->compare[0] != t->compare_written[0] || t->compare[1] != t->compare_written[1];
}

/* Counts until something happens that matters: a pin, a compare value coming into force, or one of the flags in
 * `wanted` that is not set yet. */
static uint64_t distance_to_next(const timer_state *t, uint32_t wanted) {
  uint64_t next = NEVER;
  wanted &= ~t->owner->raised;
  for (int channel = 0; channel < 2; channel++) {
    if (t->action[channel] == ACTION_NONE && !(wanted & FLAG(t->vector_compare[channel]))) continue;
    next = nearer(next, match_distance(t, place_up(t, channel)));
    if (counts_down(t)) next = nearer(next, match_distance(t, place_down(t, channel)));
  }
  bool pwm_output = t->mode == COUNT_FAST_PWM && (t->action[0] != ACTION_NONE || t->action[1] != ACTION_NONE);
  if (pwm_output) next = nearer(next, distance(t, lap_of(t) - 1));
  if (is_buffered(t) && buffer_is_waiting(t)) next = nearer(next, distance(t, place_of_update(t)));
  if (wanted & FLAG(t->vector_overflow)) {
    next = nearer(next, distance(t, is_buffered(t) ? lap_of(t) - 1 : t->maximum));
  }
  if (t->top_from == TOP_ICR && (wanted & FLAG(VECTOR_TIMER1_CAPT))) next = nearer(next, distance(t, top_of(t)));
  return next;
}

/* ---- pins ---- */

static void set_output(timer_state *t, int channel, uint8_t level, uint64_t cycle) {
  if (t->output_level[channel] == level) return;
  t->output_level[channel] = level;
  uint8_t mask = (uint8_t)(1u << t->output_bit[channel]);
  port_state *p = &t->owner->port[t->output_port[channel]];
  p->forced_level = (uint8_t)(level ? p->forced_level | mask : p->forced_level & ~mask);
  if (p->forced & mask) pins_update(t->owner, t->output_port[channel], cycle);
}

/* Output level after a compare match on the way up or down (tables 15-2 to 15-7). */
static uint8_t level_after_match(const timer_state *t, int channel, bool down) {
  uint8_t action = t->action[channel];
  if (action == ACTION_TOGGLE) return t->output_level[channel] ^ 1;
  if (counts_down(t)) {
    if (t->compare[channel] >= top_of(t)) down = true; /* never cleared: always high, or inverted */
    return action == ACTION_SET ? !down : down;
  }
  return action == ACTION_SET;
}

static bool takes_over_pin(const timer_state *t, int channel) {
  if (t->action[channel] == ACTION_NONE) return false;
  if (t->action[channel] != ACTION_TOGGLE || !is_buffered(t)) return true;
  return channel == 0 && t->top_from != TOP_FIXED; /* else reserved: the port keeps its pin */
}

/* ---- counting ---- */

static void update_compare(timer_state *t) {
  uint32_t count = count_of(t);
  t->compare[0] = t->compare_written[0];
  t->compare[1] = t->compare_written[1];
  if (counts_down(t)) set_count(t, count);
}

/* One count, at `cycle`, with all that it causes. */
static void count_once(timer_state *t, uint64_t cycle) {
  avr_board *b = t->owner;
  uint32_t here = t->position, lap = lap_of(t), top = top_of(t);
  bool wraps = here + 1 == lap;
  uint8_t level[2] = {t->output_level[0], t->output_level[1]};
  for (int channel = 0; channel < 2; channel++) {
    bool up = here == place_up(t, channel), down = counts_down(t) && here == place_down(t, channel);
    if ((up || down) && !t->match_blocked) {
      raise_flag(b, t->vector_compare[channel]);
      level[channel] = level_after_match(t, channel, down && !up);
    }
    if (wraps && t->mode == COUNT_FAST_PWM && t->action[channel] >= ACTION_CLEAR) {
      level[channel] = t->action[channel] == ACTION_CLEAR;
    }
  }
  t->match_blocked = false;
  if (is_buffered(t) ? wraps : here == t->maximum) raise_flag(b, t->vector_overflow);
  if (t->top_from == TOP_ICR && here == top) raise_flag(b, VECTOR_TIMER1_CAPT);
  bool updates = is_buffered(t) && buffer_is_waiting(t) && here == place_of_update(t);
  t->position = wraps ? 0 : here + 1;
  if (updates) update_compare(t);
  for (int channel = 0; channel < 2; channel++) {
    if (takes_over_pin(t, channel)) set_output(t, channel, level[channel], cycle);
  }
}

/* `counts` counts in which nothing happens that matters. */
static void pass(timer_state *t, uint64_t counts) {
  if (counts == 0) return;
  t->match_blocked = false;
  uint32_t lap = lap_of(t);
  if (t->position + counts < lap) {
    t->position += (uint32_t)counts;
  } else {
    counts -= lap - t->position;
    t->position = 0;
    t->position = (uint32_t)(counts % lap_of(t));
  }
}

void timer_bring_up(timer_state *t, uint64_t cycle) {
  if (cycle <= t->known) return;
  if (t->divider) {
    uint64_t base = t->owner->timer_base[t->number == 2];
    uint64_t done = (t->known - base) / t->divider;
    uint64_t counts = (cycle - base) / t->divider - done;
    while (counts) {
      uint64_t next = distance_to_next(t, UINT32_MAX);
      if (next > counts) {
        pass(t, counts);
        break;
      }
      pass(t, next - 1);
      done += next;
      counts -= next;
      count_once(t, base + done * t->divider);
    }
  }
  t->known = cycle;
}

void timer_plan(timer_state *t) {
  uint64_t next = t->divider ? distance_to_next(t, t->owner->enabled) : NEVER;
  uint64_t due = NEVER;
  if (next != NEVER) {
    uint64_t base = t->owner->timer_base[t->number == 2];
    due = base + ((t->known - base) / t->divider + next) * t->divider;
  }
  set_due(t->owner, t->source, due);
}

void timer_due(timer_state *t, uint64_t cycle) {
  timer_bring_up(t, cycle);
  timer_plan(t);
}

timer_state *timer_of_vector(avr_board *b, uint8_t vector) {
  if (vector >= VECTOR_TIMER2_COMPA && vector <= VECTOR_TIMER2_OVF) return &b->timer[2];
  if (vector >= VECTOR_TIMER1_CAPT && vector <= VECTOR_TIMER1_OVF) return &b->timer[1];
  if (vector >= VECTOR_TIMER0_COMPA && vector <= VECTOR_TIMER0_OVF) return &b->timer[0];
  return 0;
}

void timer_capture(avr_board *b, uint8_t level, uint64_t cycle) {
  timer_state *t = &b->timer[1];
  bool rising = b->avr->data[t->address_control_a + CONTROL_B] & CAPTURE_ON_RISE;
  if (t->top_from == TOP_ICR || (level != 0) != rising) return;
  timer_bring_up(t, cycle);
  t->capture = count_of(t);
  raise_flag(b, VECTOR_TIMER1_CAPT);
}

/* ---- registers ---- */

static bool is_wide(const timer_state *t) { return t->maximum > 0xFF; }

/* To be called before anything of the timer changes: brings it up to the end of the instruction. */
static uint64_t begin_change(timer_state *t) {
  uint64_t cycle = begin_access(t->owner) + 1;
  timer_bring_up(t, cycle);
  return cycle;
}

static void take_over_pins(timer_state *t, uint64_t cycle) {
  for (int channel = 0; channel < 2; channel++) {
    uint8_t port = t->output_port[channel], mask = (uint8_t)(1u << t->output_bit[channel]);
    port_state *p = &t->owner->port[port];
    p->forced = (uint8_t)(takes_over_pin(t, channel) ? p->forced | mask : p->forced & ~mask);
    p->forced_level = (uint8_t)(t->output_level[channel] ? p->forced_level | mask : p->forced_level & ~mask);
    pins_update(t->owner, port, cycle);
  }
}

/* Acts as a compare match on the pin, not on the flag; not in PWM modes (15.9.2). */
static void force_match(timer_state *t, int channel, uint64_t cycle) {
  if (is_buffered(t) || t->action[channel] == ACTION_NONE) return;
  set_output(t, channel, level_after_match(t, channel, false), cycle);
}

static void write_control(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  timer_state *t = param;
  uint64_t cycle = begin_change(t);
  unsigned which = address - (unsigned)t->address_control_a;
  uint8_t strobes = (which == CONTROL_C || (which == CONTROL_B && !is_wide(t))) ? value & 0xC0 : 0;
  avr->data[address] = (uint8_t)(value & ~strobes);
  uint8_t a = avr->data[t->address_control_a], b = avr->data[t->address_control_a + CONTROL_B];
  uint32_t count = count_of(t);
  const waveform *w = is_wide(t) ? &WIDE[(a & 3) | (b >> 1 & 0x0C)] : &NARROW[(a & 3) | (b >> 1 & 0x04)];
  t->mode = (count_mode)w->mode;
  t->top_from = (top_source)w->top_from;
  t->fixed_top = w->fixed_top;
  t->divider = t->dividers[b & 7];
  t->action[0] = a >> 6;
  t->action[1] = a >> 4 & 3;
  if (!is_buffered(t)) {
    t->compare[0] = t->compare_written[0];
    t->compare[1] = t->compare_written[1];
  }
  if (counts_down(t)) {
    set_count(t, count);
  } else {
    t->position = count;
  }
  take_over_pins(t, cycle);
  if (strobes & 0x80) force_match(t, 0, cycle);
  if (strobes & 0x40) force_match(t, 1, cycle);
  timer_plan(t);
}

static uint8_t read_count(avr_t *avr, avr_io_addr_t address, void *param) {
  timer_state *t = param;
  (void)avr;
  (void)address;
  timer_bring_up(t, begin_access(t->owner));
  uint32_t count = count_of(t);
  if (is_wide(t)) t->high_byte = (uint8_t)(count >> 8);
  return (uint8_t)count;
}

static uint8_t read_capture(avr_t *avr, avr_io_addr_t address, void *param) {
  timer_state *t = param;
  (void)avr;
  (void)address;
  begin_access(t->owner);
  t->high_byte = (uint8_t)(t->capture >> 8);
  return (uint8_t)t->capture;
}

/* High bytes of TCNT1 and ICR1 come from, and all high bytes go to, one temporary register (16.3). */
static uint8_t read_high_byte(avr_t *avr, avr_io_addr_t address, void *param) {
  const timer_state *t = param;
  (void)avr;
  (void)address;
  return t->high_byte;
}

static void write_high_byte(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  timer_state *t = param;
  (void)avr;
  (void)address;
  t->high_byte = value;
}

static uint32_t whole(const timer_state *t, uint8_t low) {
  return is_wide(t) ? (uint32_t)t->high_byte << 8 | low : low;
}

static void write_count(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  timer_state *t = param;
  (void)avr;
  (void)address;
  begin_change(t);
  set_count(t, whole(t, value));
  t->match_blocked = true;
  timer_plan(t);
}

static void write_compare(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  timer_state *t = param;
  begin_change(t);
  int channel = address == t->address_compare[1];
  t->compare_written[channel] = whole(t, value);
  avr->data[address] = value;
  if (is_wide(t)) avr->data[address + 1] = t->high_byte;
  if (!is_buffered(t)) t->compare[channel] = t->compare_written[channel];
  timer_plan(t);
}

/* ICR1 can be written only where it is the top. */
static void write_capture(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  timer_state *t = param;
  (void)avr;
  (void)address;
  begin_change(t);
  if (t->top_from != TOP_ICR) return;
  uint32_t count = count_of(t);
  t->capture = whole(t, value);
  if (counts_down(t)) set_count(t, count);
  timer_plan(t);
}

static void write_mask(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  timer_state *t = param;
  begin_change(t);
  avr->data[address] = value;
  enable_interrupt(t->owner, t->vector_overflow, value & 1);
  enable_interrupt(t->owner, t->vector_compare[0], value & 2);
  enable_interrupt(t->owner, t->vector_compare[1], value & 4);
  if (is_wide(t)) enable_interrupt(t->owner, VECTOR_TIMER1_CAPT, value & 0x20);
  timer_plan(t);
}

/* PSRSYNC and PSRASY start the prescalers anew; TSM, which would hold them, is not built. */
static void write_prescaler_reset(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  avr_board *b = param;
  (void)avr;
  (void)address;
  for (int i = 0; i < 3; i++) {
    if (!(value & (i == 2 ? 2 : 1))) continue;
    uint64_t cycle = begin_change(&b->timer[i]);
    b->timer_base[i == 2] = cycle;
  }
  for (int i = 0; i < 3; i++) timer_plan(&b->timer[i]);
}

/* ---- construction ---- */

void timers_reset(avr_board *b, uint64_t cycle) {
  for (int i = 0; i < 3; i++) {
    b->timer[i] = BUILT_IN[i];
    b->timer[i].owner = b;
    b->timer[i].known = cycle;
    b->timer[i].fixed_top = b->timer[i].maximum;
    timer_plan(&b->timer[i]);
  }
}

void timers_init(avr_board *b) {
  static const uint8_t flags[3][8] = {
      {VECTOR_TIMER0_OVF, VECTOR_TIMER0_COMPA, VECTOR_TIMER0_COMPB},
      {VECTOR_TIMER1_OVF, VECTOR_TIMER1_COMPA, VECTOR_TIMER1_COMPB, 0, 0, VECTOR_TIMER1_CAPT},
      {VECTOR_TIMER2_OVF, VECTOR_TIMER2_COMPA, VECTOR_TIMER2_COMPB},
  };
  for (int i = 0; i < 3; i++) {
    timer_state *t = &b->timer[i];
    *t = BUILT_IN[i];
    add_flag_register(b, (uint16_t)(REG_TIFR0 + i), flags[i]);
    on_write(b, t->address_control_a, write_control, t);
    on_write(b, t->address_control_a + CONTROL_B, write_control, t);
    on_read(b, t->address_count, read_count, t);
    on_write(b, t->address_count, write_count, t);
    on_write(b, t->address_mask, write_mask, t);
    for (int channel = 0; channel < 2; channel++) on_write(b, t->address_compare[channel], write_compare, t);
    if (!is_wide(t)) continue;
    on_write(b, t->address_control_a + CONTROL_C, write_control, t);
    on_read(b, t->address_count + 1, read_high_byte, t);
    on_write(b, t->address_count + 1, write_high_byte, t);
    for (int channel = 0; channel < 2; channel++) on_write(b, t->address_compare[channel] + 1, write_high_byte, t);
    on_read(b, REG_ICR1L, read_capture, t);
    on_write(b, REG_ICR1L, write_capture, t);
    on_read(b, REG_ICR1L + 1, read_high_byte, t);
    on_write(b, REG_ICR1L + 1, write_high_byte, t);
  }
  on_write(b, REG_GTCCR, write_prescaler_reset, b);
}
