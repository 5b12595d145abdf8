/* avr_timer_count.c: timer/counters 0, 1 and 2 in all their counting modes (15 to 18), computed, not stepped.
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
#include "avr_timer_count.h"

#define CAPTURE_ON_RISE 0x40u /* TCCR1B.ICES1 */

/* ---- the lap ---- */

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

uint32_t timer_count_of(const timer_state *t) {
  uint32_t top = top_of(t);
  return counts_down(t) && t->position > top ? 2 * top - t->position : t->position;
}

void timer_set_count(timer_state *t, uint32_t count) {
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

bool timer_takes_over_pin(const timer_state *t, int channel) {
  if (t->action[channel] == ACTION_NONE) return false;
  if (t->action[channel] != ACTION_TOGGLE || !is_buffered(t)) return true;
  return channel == 0 && t->top_from != TOP_FIXED; /* else reserved: the port keeps its pin */
}

void timer_force_match(timer_state *t, int channel, uint64_t cycle) {
  if (is_buffered(t) || t->action[channel] == ACTION_NONE) return;
  set_output(t, channel, level_after_match(t, channel, false), cycle);
}

/* ---- counting ---- */

static void update_compare(timer_state *t) {
  uint32_t count = timer_count_of(t);
  t->compare[0] = t->compare_written[0];
  t->compare[1] = t->compare_written[1];
  if (counts_down(t)) timer_set_count(t, count);
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
    if (timer_takes_over_pin(t, channel)) set_output(t, channel, level[channel], cycle);
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
  t->capture = timer_count_of(t);
  raise_flag(b, VECTOR_TIMER1_CAPT);
}
