/* avr_timer_count.c: timer/counters 0, 1 and 2 in all their counting modes (15 to 18), computed, not stepped.
 *
 * A timer walks round a lap: 0 up to its top, in the phase-correct modes on down to 0 again. `count` and `falling` say
 * where it was at cycle `known`; every later place follows from the prescaler. What can happen at the count that leaves a place
 * (compare match, overflow, end of the lap) is found by its distance; the timer is due only for what somebody waits for:
 * an enabled flag that is not yet set, or an output pin. Everything else is computed when a register is touched.
 *
 * A match with OCRn sets its flag, and moves its pin, one count after the count became equal (16.7.1). The compare
 * registers are double-buffered in the PWM modes. The prescalers run freely (17). With a clock from outside each edge is a
 * count.
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

/* Counts of a lap from 0 on. */
static uint32_t whole_lap(const timer_state *t) {
  uint32_t top = top_of(t);
  if (counts_down(t)) return top ? 2 * top : 1;
  return top + 1;
}

/* Counts until it is at 0 again. A timer that has missed its top on the way up goes on to its maximum (16.9.3). */
static uint32_t rest_of_lap(const timer_state *t) {
  if (t->falling) return t->count;
  return t->count > top_of(t) ? t->maximum + 1 - t->count : whole_lap(t) - t->count;
}

void timer_set_count(timer_state *t, uint32_t count) {
  t->count = count;
  if (count == 0 || !counts_down(t)) t->falling = false;
}

/* ---- distances ---- */

/* The same place in the next lap. */
static uint64_t next_lap_distance(const timer_state *t, uint32_t value, bool down) {
  uint32_t top = top_of(t);
  if (down ? value >= top : value > top) return NEVER;
  return (uint64_t)rest_of_lap(t) + (down ? 2 * top - value : value) + 1;
}

/* Counts until `value` is left, on the way up or down; 1: by the next. 0 and the top are places of the way up. */
static uint64_t distance(const timer_state *t, uint32_t value, bool down) {
  uint32_t top = top_of(t);
  if (down && t->falling && value <= t->count) return (uint64_t)t->count - value + 1;
  if (down && !t->falling && t->count <= top && value < top) return (uint64_t)rest_of_lap(t) - value + 1;
  bool ahead = !down && !t->falling && value >= t->count && (value <= top || t->count > top);
  return ahead ? (uint64_t)value - t->count + 1 : next_lap_distance(t, value, down);
}

/* The same for a compare match, which a write to the count holds off once. */
static uint64_t match_distance(const timer_state *t, uint32_t value, bool down) {
  uint64_t d = distance(t, value, down);
  return d == 1 && t->match_blocked ? next_lap_distance(t, value, down) : d;
}

static uint64_t nearer(uint64_t a, uint64_t b) { return a < b ? a : b; }

/* Counts until the buffered compare values come into force (tables 15-8, 16-4): with the count that leaves TOP or BOTTOM
 * in the phase-correct modes, that reaches BOTTOM in fast PWM (figures 15-11, 16-12). */
static uint64_t update_distance(const timer_state *t) {
  if (t->mode == COUNT_FAST_PWM) return rest_of_lap(t);
  return distance(t, t->mode == COUNT_PHASE_PWM ? top_of(t) : 0, false);
}

/* Counts until TOV: with the count that leaves MAX, in the phase-correct modes BOTTOM (figure 16-12, renamed as its text
 * says; 16.9.5: with the update of OCR1x), in fast PWM TOP. */
static uint64_t overflow_distance(const timer_state *t) {
  if (t->mode == COUNT_FAST_PWM) return rest_of_lap(t);
  return distance(t, counts_down(t) ? 0 : t->maximum, false);
}

static bool buffer_is_waiting(const timer_state *t) {
  return t->compare[0] != t->compare_written[0] || t->compare[1] != t->compare_written[1];
}

/* Counts until something happens that matters: a pin, a compare value coming into force, or one of the flags in
 * `wanted` that is not set yet. */
static uint64_t distance_to_next(const timer_state *t, uint32_t wanted) {
  uint64_t next = NEVER;
  wanted &= ~t->owner->core.raised;
  for (int channel = 0; channel < 2; channel++) {
    if (t->action[channel] == ACTION_NONE && !(wanted & FLAG(t->vector_compare[channel]))) continue;
    uint32_t value = t->compare[channel];
    next = nearer(next, match_distance(t, value, false));
    if (counts_down(t) && value > 0) next = nearer(next, match_distance(t, value, true));
  }
  bool pwm_output = t->mode == COUNT_FAST_PWM && (t->action[0] != ACTION_NONE || t->action[1] != ACTION_NONE);
  if (pwm_output) next = nearer(next, rest_of_lap(t));
  if (is_buffered(t) && buffer_is_waiting(t)) next = nearer(next, update_distance(t));
  if (wanted & FLAG(t->vector_overflow)) next = nearer(next, overflow_distance(t));
  if (t->top_from == TOP_ICR && (wanted & FLAG(VECTOR_TIMER1_CAPT))) next = nearer(next, distance(t, top_of(t), false));
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
  /* Tables 15-2 to 15-4, 16-2, 16-3: OCnA only; else the port keeps its pin. */
  return channel == 0 && (t->top_from == TOP_OCRA || (t->top_from == TOP_ICR && t->mode == COUNT_FAST_PWM));
}

void timer_force_match(timer_state *t, int channel, uint64_t cycle) {
  avr_board *b = t->owner;
  if (is_buffered(t)) note(b, b->core.pc, "forces", "a compare match", "it is dropped in PWM modes (15.9.2, 16.11.3)");
  if (is_buffered(t) || t->action[channel] == ACTION_NONE) return;
  set_output(t, channel, level_after_match(t, channel, false), cycle);
}

/* ---- counting ---- */

static void update_compare(timer_state *t) {
  t->compare[0] = t->compare_written[0];
  t->compare[1] = t->compare_written[1];
}

/* `counts` counts under the same top. Where it has changed since the slope began, the way down goes on from where that
 * turned (16.9.4). */
static void move(timer_state *t, uint64_t counts) {
  if (counts == 0) return;
  t->match_blocked = false;
  uint32_t top = top_of(t), rest = rest_of_lap(t);
  if (counts >= rest) {
    timer_set_count(t, 0);
    counts = (counts - rest) % whole_lap(t);
  }
  if (t->falling) {
    t->count -= (uint32_t)counts;
  } else if (counts_down(t) && t->count <= top && t->count + counts > top) {
    t->falling = true;
    t->count = 2 * top - t->count - (uint32_t)counts;
  } else {
    t->count += (uint32_t)counts;
  }
}

/* One count, at `cycle`, with all that it causes. */
void timer_count_once(timer_state *t, uint64_t cycle) {
  avr_board *b = t->owner;
  bool wraps = rest_of_lap(t) == 1;
  uint8_t level[2] = {t->output_level[0], t->output_level[1]};
  for (int channel = 0; channel < 2; channel++) {
    if (t->count == t->compare[channel] && !t->match_blocked) {
      raise_flag(b, t->vector_compare[channel]);
      level[channel] = level_after_match(t, channel, t->falling);
    }
    if (wraps && t->mode == COUNT_FAST_PWM && t->action[channel] >= ACTION_CLEAR) {
      level[channel] = t->action[channel] == ACTION_CLEAR;
    }
  }
  if (overflow_distance(t) == 1) raise_flag(b, t->vector_overflow);
  if (t->top_from == TOP_ICR && !t->falling && t->count == top_of(t)) raise_flag(b, VECTOR_TIMER1_CAPT);
  bool updates = is_buffered(t) && buffer_is_waiting(t) && update_distance(t) == 1;
  bool at_bottom = t->mode == COUNT_PHASE_FREQUENCY_PWM;
  if (updates && at_bottom) update_compare(t);
  move(t, 1);
  if (updates && !at_bottom) update_compare(t);
  for (int channel = 0; channel < 2; channel++) {
    if (timer_takes_over_pin(t, channel)) set_output(t, channel, level[channel], cycle);
  }
}

void timer_bring_up(timer_state *t, uint64_t cycle) {
  if (cycle <= t->known) return;
  if (t->prescaler != NO_CLOCK) {
    uint64_t base = t->owner->timer_base[t->number == 2];
    uint64_t done = (t->known - base) >> t->prescaler;
    uint64_t counts = ((cycle - base) >> t->prescaler) - done;
    while (counts) {
      const uint64_t next = t->next ? t->next : distance_to_next(t, UINT32_MAX);
      t->next = next > counts ? next - counts : 0;
      if (t->next) {
        move(t, counts);
        break;
      }
      move(t, next - 1);
      done += next;
      counts -= next;
      timer_count_once(t, base + (done << t->prescaler));
    }
  }
  t->known = cycle;
}

void timer_plan(timer_state *t) {
  t->next = 0; /* whatever has changed */
  uint64_t next = t->prescaler != NO_CLOCK ? distance_to_next(t, t->owner->core.enabled) : NEVER;
  uint64_t due = NEVER;
  if (next != NEVER) {
    uint64_t base = t->owner->timer_base[t->number == 2];
    due = base + ((((t->known - base) >> t->prescaler) + next) << t->prescaler);
  }
  set_due(t->owner, DUE_TIMER0 + t->number, due);
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
  bool rising = b->core.data[t->address_control_a + CONTROL_B] & CAPTURE_ON_RISE;
  if (t->top_from == TOP_ICR || (level != 0) != rising) return;
  timer_bring_up(t, cycle);
  t->capture = t->count;
  raise_flag(b, VECTOR_TIMER1_CAPT);
}
