/* avr_pins.c: the three ports with what the outside drives, pin-change and external interrupts (13, 14).
 *
 * An input that the outside drives stays driven whatever the program writes to PORT or DDR; an input that nobody drives
 * reads 1 with a pull-up and else keeps its last level. A pin's level is read one cycle late (14.2.4); its edges reach
 * the interrupts and the capture unit INPUT_LATENCY_CYCLES late.
 */
#include <stdlib.h>

#include "avr_parts.h"

#define PULL_UPS_DISABLED 0x10u /* MCUCR.PUD */
#define NOISE_FILTER_ON 0x80u   /* TCCR1B.ICNC1 */
#define NOISE_FILTER_CYCLES 4u  /* (16.6.2) */
#define REG_TCCR1B 0x81
#define NO_PIN 0xFFu

enum { RX_BIT = 0, INT0_BIT = 2, INT1_BIT = 3 }; /* of port D */
enum { CAPTURE_BIT = 0 };                        /* of port B */

static const struct {
  uint8_t port, bit;
} PLACES[BOARD_PIN_COUNT] = {
    {PORT_D, 0}, {PORT_D, 1}, {PORT_D, 2}, {PORT_D, 3}, {PORT_D, 4}, {PORT_D, 5}, {PORT_D, 6},
    {PORT_D, 7}, {PORT_B, 0}, {PORT_B, 1}, {PORT_B, 2}, {PORT_B, 3}, {PORT_B, 4}, {PORT_B, 5},
    {PORT_C, 0}, {PORT_C, 1}, {PORT_C, 2}, {PORT_C, 3}, {PORT_C, 4}, {PORT_C, 5},
};

/* Where a port's registers are: PIN, then DDR, then PORT. */
static const uint8_t ADDRESSES[PORT_COUNT] = {REG_PINB, REG_PINC, REG_PIND};

uint8_t pin_of(uint8_t port, unsigned bit) {
  static const uint8_t first[PORT_COUNT] = {8, 14, 0};
  unsigned count = port == PORT_D ? 8 : 6;
  return bit < count ? (uint8_t)(first[port] + bit) : NO_PIN;
}

/* ---- queues of changes ---- */

/* Behind all that are not later. */
static void insert(change_queue *q, pin_change change) {
  q->items = board_room_for(q->items, sizeof *q->items, &q->first, &q->end, &q->capacity, 1);
  size_t i = q->end++;
  for (; i > q->first && q->items[i - 1].at > change.at; i--) q->items[i] = q->items[i - 1];
  q->items[i] = change;
}

/* Takes out what is queued for a pin from `at` on. */
static void remove_from(change_queue *q, uint8_t pin, uint64_t at) {
  size_t i = q->end;
  while (i > q->first && q->items[i - 1].at >= at) i--;
  size_t kept = i;
  for (; i < q->end; i++) {
    if (q->items[i].pin != pin) q->items[kept++] = q->items[i];
  }
  q->end = kept;
}

static uint64_t first_due(const change_queue *q) { return q->first < q->end ? q->items[q->first].at : NEVER; }

/* ---- ports ---- */

/* Hands edges to what reacts to edges: pin-change, capture and external interrupts. */
static void see_edges(avr_board *b, uint8_t port, uint8_t moved, uint64_t cycle) {
  uint8_t watched = b->core.data[REG_PCMSK0 + port];
  if (port == PORT_B) watched |= 1u << CAPTURE_BIT;
  if (port == PORT_D) watched |= 1u << INT0_BIT | 1u << INT1_BIT | b->clock_pins;
  for (uint8_t bit = 0; bit < 8; bit++) {
    if (!(moved & watched & 1u << bit)) continue;
    uint8_t level = b->port[port].level >> bit & 1u;
    insert(&b->seen_edges, (pin_change){cycle + INPUT_LATENCY_CYCLES, bit, level, port});
  }
  set_due(b, DUE_SEEN_EDGE, first_due(&b->seen_edges));
}

static uint8_t shown(const port_state *p, unsigned bit) {
  if (p->out >> bit & 1) return p->out_level >> bit & 1 ? BOARD_HIGH : BOARD_LOW;
  return p->pulled >> bit & 1 ? BOARD_PULLED_UP : BOARD_RELEASED;
}

void pins_update(avr_board *b, uint8_t port, uint64_t cycle) {
  port_state *p = &b->port[port];
  const uint8_t *registers = b->core.data + ADDRESSES[port];
  uint8_t direction = registers[1], value = registers[2];
  bool pull_ups = !(b->core.data[REG_MCUCR] & PULL_UPS_DISABLED);
  port_state before = *p;
  p->out = (uint8_t)((direction | p->forced_out) & ~p->forced_in);
  uint8_t port_level = (uint8_t)(value & ~(p->forced | p->shifted));
  p->out_level = (uint8_t)((port_level | (p->forced_level & p->forced) | p->shifted_level) & p->out);
  p->pulled = pull_ups ? (uint8_t)(value & ~p->out) : 0;
  uint8_t undriven = (uint8_t)(p->pulled | p->level);
  uint8_t outside = (uint8_t)((p->driven & p->driven_level) | (~p->driven & undriven));
  uint8_t level = (uint8_t)(p->out_level | (~p->out & outside));
  uint8_t moved = level ^ p->level;
  if (moved) {
    if (p->changed != cycle) p->level_before = p->level;
    p->changed = cycle;
    p->level = level;
    see_edges(b, port, moved, cycle);
    if (port == PORT_C) twi_line_moved(b, cycle);
  }
  uint8_t changes = (uint8_t)((p->out ^ before.out) | (p->out_level ^ before.out_level) | (p->pulled ^ before.pulled));
  for (unsigned bit = 0; changes; bit++, changes >>= 1) {
    uint8_t pin = pin_of(port, bit);
    if (!(changes & 1) || pin == NO_PIN) continue;
    b->counters.edges_out++;
    if (board_show_edge(&b->base, cycle, pin, shown(p, bit))) avr_stop(&b->core);
  }
  if (port == PORT_B) spi_pins_moved(b, cycle);
  if (__builtin_expect(!b->checks.on, true)) return;
  uint8_t against = (uint8_t)(p->out & p->driven & (p->out_level ^ p->driven_level));
  for (unsigned bit = 0; against; bit++, against >>= 1) {
    if ((against & 1) && pin_of(port, bit) != NO_PIN) check_driven(b, pin_of(port, bit), p->out_level >> bit & 1);
  }
}

static uint8_t port_of(uint16_t address) { return (uint8_t)((address - REG_PINB) / 3); }

static uint8_t read_pins(avr_board *b, uint16_t address, uint64_t cycle) {
  const uint8_t port = port_of(address);
  const port_state *p = &b->port[port];
  uint8_t level = p->changed >= cycle ? p->level_before : p->level;
  if (__builtin_expect(b->checks.on, false)) check_read(b, port);
  return port == PORT_D ? usart_at_pins(b, level, cycle) : level;
}

static void write_port(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  if (b->core.data[address] == value) return;
  b->core.data[address] = value;
  pins_update(b, port_of(address), end);
}

/* Ones written to PINx toggle PORTx (14.2.2). */
static void write_pins(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  write_port(b, (uint16_t)(address + 2), b->core.data[address + 2] ^ value, end);
}

static void write_control(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  b->core.data[address] = value;
  for (uint8_t port = 0; port < PORT_COUNT; port++) pins_update(b, port, end);
}

/* ---- interrupts ---- */

static unsigned external_mode(const avr_board *b, unsigned number) {
  return b->core.data[REG_EICRA] >> (2 * number) & 3u;
}

/* Mode 0 asks for the interrupt as long as the pin is low. */
static void update_level_interrupt(avr_board *b, unsigned number) {
  if (external_mode(b, number) != 0) return;
  uint8_t vector = (uint8_t)(VECTOR_INT0 + number);
  bool low = !(b->port[PORT_D].level >> (INT0_BIT + number) & 1u);
  if (low && (b->core.enabled & FLAG(vector))) {
    raise_flag(b, vector);
  } else {
    clear_flag(b, vector);
  }
}

void pins_acknowledged(avr_board *b, uint8_t vector) { update_level_interrupt(b, vector - (unsigned)VECTOR_INT0); }

static void external_edge(avr_board *b, unsigned number, uint8_t level) {
  unsigned mode = external_mode(b, number);
  if (mode == 0) {
    update_level_interrupt(b, number);
  } else if (mode == 1 || mode == (level ? 3u : 2u)) {
    raise_flag(b, (uint8_t)(VECTOR_INT0 + number));
  }
}

static void capture_edge(avr_board *b, uint8_t level, uint64_t cycle) {
  if (b->core.data[REG_TCCR1B] & NOISE_FILTER_ON) {
    set_due(b, DUE_NOISE_FILTER, level == b->capture_level ? NEVER : cycle + NOISE_FILTER_CYCLES);
  } else {
    b->capture_level = level;
    timer_capture(b, level, cycle);
  }
}

void pins_due_noise_filter(avr_board *b, uint64_t cycle) {
  set_due(b, DUE_NOISE_FILTER, NEVER);
  b->capture_level ^= 1;
  timer_capture(b, b->capture_level, cycle);
}

void pins_due_seen(avr_board *b, uint64_t cycle) {
  change_queue *q = &b->seen_edges;
  while (first_due(q) <= cycle) {
    pin_change edge = q->items[q->first++];
    if (b->core.data[REG_PCMSK0 + edge.port] >> edge.pin & 1) raise_flag(b, (uint8_t)(VECTOR_PCINT0 + edge.port));
    if (edge.port == PORT_B && edge.pin == CAPTURE_BIT) capture_edge(b, edge.level, edge.at);
    if (edge.port == PORT_D && edge.pin == INT0_BIT) external_edge(b, 0, edge.level);
    if (edge.port == PORT_D && edge.pin == INT1_BIT) external_edge(b, 1, edge.level);
    if (edge.port == PORT_D && b->clock_pins >> edge.pin & 1) {
      timer_clock_edge(b, edge.pin - TIMER0_CLOCK_BIT, edge.level, edge.at);
    }
  }
  set_due(b, DUE_SEEN_EDGE, first_due(q));
}

static void write_pin_change_enables(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  b->core.data[address] = value;
  for (uint8_t port = 0; port < PORT_COUNT; port++) {
    enable_interrupt(b, (uint8_t)(VECTOR_PCINT0 + port), value >> port & 1);
    if (value >> port & 1) check_watched(b, port, b->core.data[REG_PCMSK0 + port]);
  }
}

static void write_pin_change_mask_d(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  usart_watched(b, value, end);
  b->core.data[address] = value;
  if (b->core.data[REG_PCICR] >> PORT_D & 1) check_watched(b, PORT_D, value);
}

static void write_external_enables(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  b->core.data[address] = value;
  check_watched(b, PORT_D, (uint8_t)(value << INT0_BIT));
  for (uint8_t number = 0; number < 2; number++) {
    enable_interrupt(b, (uint8_t)(VECTOR_INT0 + number), value >> number & 1);
    update_level_interrupt(b, number);
  }
}

static void write_external_modes(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  b->core.data[address] = value;
  for (uint8_t number = 0; number < 2; number++) update_level_interrupt(b, number);
}

/* ---- the outside ---- */

static void log_driven(avr_board *b, uint64_t cycle, pin_change change) {
  struct board_edges *log = &b->outside_log.driven;
  log->items = board_room_for(log->items, sizeof *log->items, &log->first, &log->end, &log->capacity, 1);
  log->items[log->end++] = (board_edge){.cycle = cycle, .pin = change.pin, .level = change.level};
}

void pins_due_driven(avr_board *b, uint64_t cycle) {
  change_queue *q = &b->driven_edges;
  while (first_due(q) <= cycle) {
    pin_change change = q->items[q->first++];
    uint8_t port = PLACES[change.pin].port, mask = (uint8_t)(1u << PLACES[change.pin].bit);
    port_state *p = &b->port[port];
    p->driven = (uint8_t)(change.level == BOARD_RELEASED ? p->driven & ~mask : p->driven | mask);
    p->driven_level = (uint8_t)(change.level == BOARD_HIGH ? p->driven_level | mask : p->driven_level & ~mask);
    pins_update(b, port, cycle);
    if (board_stops_at(&b->base, change.pin)) avr_stop(&b->core);
    if (b->outside_log.on) log_driven(b, cycle, change);
    if (b->outside_log.heard) b->outside_log.heard(b->outside_log.heard_context, cycle, change.pin, change.level);
  }
  set_due(b, DUE_DRIVEN_EDGE, first_due(q));
}

void pins_drive(avr_board *b, uint64_t at, uint8_t pin, uint8_t level) {
  if (pin >= BOARD_PIN_COUNT || level > BOARD_RELEASED) return;
  if (at < b->core.clock) at = b->core.clock;
  remove_from(&b->driven_edges, pin, at);
  insert(&b->driven_edges, (pin_change){at, pin, level, 0});
  set_due(b, DUE_DRIVEN_EDGE, first_due(&b->driven_edges));
}

uint8_t *pins_levels(avr_board *b) {
  for (unsigned pin = 0; pin < BOARD_PIN_COUNT; pin++) {
    b->levels[pin] = b->port[PLACES[pin].port].level >> PLACES[pin].bit & 1u;
  }
  return b->levels;
}

uint8_t pins_output(const avr_board *b, uint8_t pin) {
  if (pin >= BOARD_PIN_COUNT) return BOARD_RELEASED;
  return shown(&b->port[PLACES[pin].port], PLACES[pin].bit);
}

bool pin_floats(const avr_board *b, uint8_t pin) {
  const port_state *p = &b->port[PLACES[pin].port];
  return !((p->out | p->pulled | p->driven) >> PLACES[pin].bit & 1);
}

/* ---- construction ---- */

void pins_reset(avr_board *b, uint64_t cycle) {
  b->seen_edges.first = b->seen_edges.end = 0;
  set_due(b, DUE_SEEN_EDGE, NEVER);
  set_due(b, DUE_NOISE_FILTER, NEVER);
  for (uint8_t port = 0; port < PORT_COUNT; port++) {
    port_state *p = &b->port[port];
    p->forced = p->forced_out = p->forced_in = p->shifted = p->shifted_level = 0;
    pins_update(b, port, cycle);
  }
  b->capture_level = b->port[PORT_B].level >> CAPTURE_BIT & 1u;
}

void pins_init(avr_board *b) {
  for (uint8_t port = 0; port < PORT_COUNT; port++) {
    on_read(b, ADDRESSES[port], read_pins);
    on_write(b, ADDRESSES[port], write_pins);
    on_ones(b, ADDRESSES[port]);
    on_write(b, (uint16_t)(ADDRESSES[port] + 1), write_port);
    on_write(b, (uint16_t)(ADDRESSES[port] + 2), write_port);
  }
  on_write(b, REG_MCUCR, write_control);
  on_write(b, REG_PCICR, write_pin_change_enables);
  on_write(b, REG_PCMSK0 + PORT_D, write_pin_change_mask_d);
  on_write(b, REG_EIMSK, write_external_enables);
  on_write(b, REG_EICRA, write_external_modes);
  /* the line to the outside rests high */
  b->port[PORT_D].driven = b->port[PORT_D].driven_level = 1u << RX_BIT;
}

void pins_free(avr_board *b) {
  free(b->driven_edges.items);
  free(b->seen_edges.items);
  free(b->outside_log.driven.items);
}
