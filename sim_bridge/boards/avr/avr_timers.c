/* avr_timers.c: the registers of timer/counters 0, 1 and 2 (15.9, 16.11, 18.11), and what is built into each.
 *
 * How they count is in avr_timer_count.c. Each access first brings the timer up to its cycle.
 */
#include "avr_timer_count.h"

#define REG_ICR1L 0x86
enum { CLOCK_FALLING = 6, CLOCK_RISING }; /* CSn2:0 of timers 0 and 1: edges of their pins (table 15-9, 16-5) */

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

/* By CSn2:0: a count takes 1 << this CPU cycles (tables 15-9, 16-5, 18-9). */
static const uint8_t PRESCALERS[8] = {NO_CLOCK, 0, 3, 6, 8, 10, NO_CLOCK, NO_CLOCK};
static const uint8_t PRESCALERS_OF_2[8] = {NO_CLOCK, 0, 3, 5, 6, 7, 8, 10};

static const timer_state BUILT_IN[3] = {
    {.number = 0,
     .address_control_a = 0x44,
     .address_count = 0x46,
     .address_compare = {0x47, 0x48},
     .vector_overflow = VECTOR_TIMER0_OVF,
     .vector_compare = {VECTOR_TIMER0_COMPA, VECTOR_TIMER0_COMPB},
     .output_port = {PORT_D, PORT_D},
     .output_bit = {6, 5},
     .prescalers = PRESCALERS,
     .maximum = 0xFF},
    {.number = 1,
     .address_control_a = 0x80,
     .address_count = 0x84,
     .address_compare = {0x88, 0x8A},
     .vector_overflow = VECTOR_TIMER1_OVF,
     .vector_compare = {VECTOR_TIMER1_COMPA, VECTOR_TIMER1_COMPB},
     .output_port = {PORT_B, PORT_B},
     .output_bit = {1, 2},
     .prescalers = PRESCALERS,
     .maximum = 0xFFFF},
    {.number = 2,
     .address_control_a = 0xB0,
     .address_count = 0xB2,
     .address_compare = {0xB3, 0xB4},
     .vector_overflow = VECTOR_TIMER2_OVF,
     .vector_compare = {VECTOR_TIMER2_COMPA, VECTOR_TIMER2_COMPB},
     .output_port = {PORT_B, PORT_D},
     .output_bit = {3, 3},
     .prescalers = PRESCALERS_OF_2,
     .maximum = 0xFF},
};

/* ---- clocks from outside (17.3) ---- */

void timer_clock_edge(avr_board *b, unsigned number, uint8_t level, uint64_t cycle) {
  timer_state *t = &b->timer[number];
  unsigned clock = b->core.data[t->address_control_a + CONTROL_B] & 7u;
  if (clock == (level ? CLOCK_RISING : CLOCK_FALLING)) timer_count_once(t, cycle);
}

/* ---- registers ---- */

static timer_state *timer_at(avr_board *b, uint16_t address) {
  if (address >= REG_TIMSK0 && address < REG_TIMSK0 + 3) return &b->timer[address - REG_TIMSK0];
  return &b->timer[(address >= BUILT_IN[1].address_control_a) + (address >= BUILT_IN[2].address_control_a)];
}

static void take_over_pins(timer_state *t, uint64_t cycle) {
  for (int channel = 0; channel < 2; channel++) {
    uint8_t port = t->output_port[channel], mask = (uint8_t)(1u << t->output_bit[channel]);
    port_state *p = &t->owner->port[port];
    p->forced = (uint8_t)(timer_takes_over_pin(t, channel) ? p->forced | mask : p->forced & ~mask);
    p->forced_level = (uint8_t)(t->output_level[channel] ? p->forced_level | mask : p->forced_level & ~mask);
    pins_update(t->owner, port, cycle);
  }
}

static void write_control(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  timer_state *t = timer_at(b, address);
  timer_bring_up(t, end);
  unsigned which = address - (unsigned)t->address_control_a;
  uint8_t strobes = (which == CONTROL_C || (which == CONTROL_B && !is_wide(t))) ? value & 0xC0 : 0;
  b->core.data[address] = (uint8_t)(value & ~strobes);
  const uint8_t *control = b->core.data + t->address_control_a;
  uint8_t wave = (uint8_t)((control[CONTROL_A] & 3) | (control[CONTROL_B] >> 1 & 0x0C));
  const waveform *w = is_wide(t) ? &WIDE[wave] : &NARROW[wave & 7];
  t->mode = (count_mode)w->mode;
  t->top_from = (top_source)w->top_from;
  t->fixed_top = w->fixed_top;
  t->prescaler = t->prescalers[control[CONTROL_B] & 7];
  if (which == CONTROL_B && t->number < 2) {
    uint8_t pin = (uint8_t)(1u << (TIMER0_CLOCK_BIT + t->number));
    b->clock_pins = (uint8_t)((control[CONTROL_B] & 7) >= CLOCK_FALLING ? b->clock_pins | pin : b->clock_pins & ~pin);
  }
  t->action[0] = control[CONTROL_A] >> 6;
  t->action[1] = control[CONTROL_A] >> 4 & 3;
  if (!is_buffered(t)) {
    t->compare[0] = t->compare_written[0];
    t->compare[1] = t->compare_written[1];
  }
  timer_set_count(t, t->count);
  take_over_pins(t, end);
  if (strobes & 0x80) timer_force_match(t, 0, end);
  if (strobes & 0x40) timer_force_match(t, 1, end);
  timer_plan(t);
}

static uint8_t read_count(avr_board *b, uint16_t address, uint64_t cycle) {
  timer_state *t = timer_at(b, address);
  timer_bring_up(t, cycle);
  if (is_wide(t)) t->high_byte = (uint8_t)(t->count >> 8);
  return (uint8_t)t->count;
}

static uint8_t read_capture(avr_board *b, uint16_t address, uint64_t cycle) {
  timer_state *t = timer_at(b, address);
  t->high_byte = (uint8_t)(t->capture >> 8);
  return (uint8_t)t->capture;
}

/* High bytes of TCNT1 and ICR1 come from, and all high bytes go to, one temporary register (16.3). */
static uint8_t read_high_byte(avr_board *b, uint16_t address, uint64_t cycle) {
  const timer_state *t = timer_at(b, address);
  return t->high_byte;
}

static void write_high_byte(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  timer_state *t = timer_at(b, address);
  if (t->open_half == address - 1 && value != t->high_byte) {
    note(t->owner, b->core.pc, "writes", "a high byte behind its low one", "the register took the old one (16.3)");
  }
  t->open_half = address;
  t->high_byte = value;
}

/* The value that a write of a low byte completes. It waits for no other half if a high byte, which has an odd address,
 * came just before. */
static uint32_t whole(timer_state *t, uint16_t address, uint8_t low) {
  if (!is_wide(t)) return low;
  t->open_half = t->open_half & 1 ? 0 : address;
  return (uint32_t)t->high_byte << 8 | low;
}

static void write_count(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  timer_state *t = timer_at(b, address);
  timer_bring_up(t, end);
  timer_set_count(t, whole(t, address, value));
  t->match_blocked = true;
  timer_plan(t);
}

static void write_compare(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  timer_state *t = timer_at(b, address);
  timer_bring_up(t, end);
  int channel = address == t->address_compare[1];
  t->compare_written[channel] = whole(t, address, value);
  b->core.data[address] = value;
  if (is_wide(t)) b->core.data[address + 1] = t->high_byte;
  if (!is_buffered(t)) t->compare[channel] = t->compare_written[channel];
  timer_plan(t);
}

/* ICR1 can be written only where it is the top. */
static void write_capture(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  timer_state *t = timer_at(b, address);
  timer_bring_up(t, end);
  const uint32_t capture = whole(t, address, value);
  if (t->top_from == TOP_ICR) {
    t->capture = capture;
  } else if (t->capture != capture) {
    note(t->owner, b->core.pc, "writes to", "ICR1", "it is dropped: the mode has not ICR1 as its top (16.6)");
  }
  timer_plan(t);
}

static void write_mask(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  timer_state *t = timer_at(b, address);
  timer_bring_up(t, end);
  b->core.data[address] = value;
  enable_interrupt(t->owner, t->vector_overflow, value & 1);
  enable_interrupt(t->owner, t->vector_compare[0], value & 2);
  enable_interrupt(t->owner, t->vector_compare[1], value & 4);
  if (is_wide(t)) enable_interrupt(t->owner, VECTOR_TIMER1_CAPT, value & 0x20);
  timer_plan(t);
}

/* PSRSYNC, of timers 0 and 1, and PSRASY start the prescalers anew; TSM, which would hold them, is not built. */
static void write_prescaler_reset(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  for (int i = 0; i < 3; i++) timer_bring_up(&b->timer[i], end);
  for (int asynchronous = 0; asynchronous < 2; asynchronous++) {
    if (value >> asynchronous & 1) b->timer_base[asynchronous] = end;
  }
  for (int i = 0; i < 3; i++) timer_plan(&b->timer[i]);
}

/* ---- construction ---- */

void timers_reset(avr_board *b, uint64_t cycle) {
  b->clock_pins = 0;
  for (int i = 0; i < 3; i++) {
    b->timer[i] = BUILT_IN[i];
    b->timer[i].owner = b;
    b->timer[i].known = cycle;
    b->timer[i].prescaler = NO_CLOCK;
    b->timer[i].fixed_top = b->timer[i].maximum;
    timer_plan(&b->timer[i]);
  }
}

void timers_init(avr_board *b) {
  for (int i = 0; i < 3; i++) {
    timer_state *t = &b->timer[i];
    *t = BUILT_IN[i];
    on_write(b, t->address_control_a, write_control);
    on_write(b, t->address_control_a + CONTROL_B, write_control);
    on_read(b, t->address_count, read_count);
    on_write(b, t->address_count, write_count);
    on_write(b, (uint16_t)(REG_TIMSK0 + i), write_mask);
    for (int channel = 0; channel < 2; channel++) on_write(b, t->address_compare[channel], write_compare);
    if (!is_wide(t)) continue;
    on_write(b, t->address_control_a + CONTROL_C, write_control);
    on_read(b, t->address_count + 1, read_high_byte);
    on_write(b, t->address_count + 1, write_high_byte);
    for (int channel = 0; channel < 2; channel++) on_write(b, t->address_compare[channel] + 1, write_high_byte);
    on_read(b, REG_ICR1L, read_capture);
    on_write(b, REG_ICR1L, write_capture);
    on_read(b, REG_ICR1L + 1, read_high_byte);
    on_write(b, REG_ICR1L + 1, write_high_byte);
  }
  on_write(b, REG_GTCCR, write_prescaler_reset);
}
