/* avr_twi.c: the two-wire interface as a master (22), bit by bit on SDA (PC4, pin 18) and SCL (PC5, pin 19).
 *
 * Both lines are open drain: low or let go; what pulls them up is outside, or the pull-ups of port C. One period of SCL
 * takes 16 + 2 * TWBR * 4^TWPS cycles (22.5.2), half of it low. A byte with its acknowledgement takes nine of them; SDA
 * changes HOLD_CYCLES after SCL has fallen and is sampled when SCL is about to fall. Whoever holds SCL low stretches the
 * period: its high half begins when the line is high. START and STOP take a period each, a START on a free bus first
 * waits half a period; the data sheet does not say. After each of them but STOP, TWINT is set and SCL held low.
 *
 * Not built: slave modes (own addresses are never answered), bus errors by misplaced START and STOP of others.
 */
#include "avr_parts.h"

#define HOLD_CYCLES 4u
#define SDA_MASK 0x10u
#define SCL_MASK 0x20u
#define BITS 9 /* of a byte and its acknowledgement */

enum { TWEA = 0x40, TWSTA = 0x20, TWSTO = 0x10, TWWC = 0x08, TWEN = 0x04, TWIE = 0x01, TWINT = 0x80 };

/* Status codes of a master (tables 22-2, 22-3). */
enum {
  STATUS_START = 0x08,
  STATUS_REPEATED_START = 0x10,
  STATUS_ADDRESS_WRITE = 0x18, /* acknowledged; 8 more: not */
  STATUS_DATA_WRITE = 0x28,    /* acknowledged; 8 more: not */
  STATUS_LOST = 0x38,
  STATUS_ADDRESS_READ = 0x40, /* acknowledged; 8 more: not */
  STATUS_DATA_READ = 0x50,    /* with acknowledgement; 8 more: without */
  STATUS_NONE = 0xF8
};

static uint64_t half_period(const avr_board *b) {
  const unsigned prescaler = 1u << 2 * (b->twi.prescaler & 3u);
  return 8u + (uint64_t)b->twi.rate * prescaler;
}

/* Holds lines low or lets them go. */
static void put(avr_board *b, bool sda_low, bool scl_low, uint64_t cycle) {
  port_state *p = &b->port[PORT_C];
  const uint8_t low = (uint8_t)((sda_low ? SDA_MASK : 0) | (scl_low ? SCL_MASK : 0));
  const uint8_t both = SDA_MASK | SCL_MASK;
  b->twi.sda_low = sda_low;
  p->forced |= both;
  p->forced_level = (uint8_t)(p->forced_level & ~both);
  p->forced_out = (uint8_t)((p->forced_out & ~both) | low);
  p->forced_in = (uint8_t)((p->forced_in & ~both) | (both & ~low));
  pins_update(b, PORT_C, cycle);
}

static bool is_high(const avr_board *b, uint8_t mask) { return (b->port[PORT_C].level & mask) == mask; }

static void plan(avr_board *b, twi_phase phase, uint64_t cycle) {
  b->twi.phase = phase;
  set_due(b, DUE_TWI, cycle);
}

/* Something is complete: the program's turn. SCL stays low meanwhile. */
static void complete(avr_board *b, uint8_t status) {
  b->twi.status = status;
  plan(b, TWI_IDLE, NEVER);
  raise_flag(b, VECTOR_TWI);
}

/* ---- a byte ---- */

static bool is_read_address(const twi_state *t) { return t->is_address && (t->data & 1); }

/* What the board sends as this bit: 1 lets go of the line. */
static bool bit_to_send(const twi_state *t) {
  if (t->receiving) return t->bit < 8 || !(t->control & TWEA);
  return t->bit == 8 || t->shift >> (7 - t->bit) & 1;
}

static void end_byte(avr_board *b, bool acknowledged) {
  twi_state *t = &b->twi;
  uint8_t status = STATUS_DATA_WRITE;
  if (t->receiving) {
    t->data = t->shift;
    status = STATUS_DATA_READ;
  } else if (t->is_address) {
    status = is_read_address(t) ? STATUS_ADDRESS_READ : STATUS_ADDRESS_WRITE;
  }
  complete(b, (uint8_t)(status + (acknowledged ? 0 : 8)));
}

/* The high half of a bit is over. */
static void end_bit(avr_board *b, uint64_t cycle) {
  twi_state *t = &b->twi;
  const bool level = is_high(b, SDA_MASK);
  if (!t->receiving && t->bit < 8 && !level && bit_to_send(t)) { /* another master's */
    t->owner = false;
    put(b, false, false, cycle);
    complete(b, STATUS_LOST);
    return;
  }
  if (t->receiving && t->bit < 8) t->shift = (uint8_t)(t->shift << 1 | level);
  put(b, t->sda_low, true, cycle);
  if (++t->bit == BITS) {
    end_byte(b, !level);
  } else {
    t->fallen = cycle;
    plan(b, TWI_BIT_SET, cycle + HOLD_CYCLES);
  }
}

static void begin_byte(avr_board *b, uint64_t cycle) {
  twi_state *t = &b->twi;
  const uint8_t status = t->status;
  t->is_address = status == STATUS_START || status == STATUS_REPEATED_START;
  t->receiving = status == STATUS_ADDRESS_READ || status == STATUS_DATA_READ;
  t->shift = t->receiving ? 0 : t->data;
  t->bit = 0;
  t->fallen = cycle;
  plan(b, TWI_BIT_SET, cycle);
}

/* ---- START, STOP and their parts ---- */

static void wait_for_free_bus(avr_board *b, uint64_t cycle) {
  if (is_high(b, SDA_MASK | SCL_MASK)) {
    plan(b, TWI_START_FALL, cycle + half_period(b));
  } else {
    plan(b, TWI_WAIT_FREE, NEVER);
  }
}

/* Lets go of SCL; when it is high, `phase` comes after another half period. */
static void raise_clock(avr_board *b, twi_phase phase, uint64_t cycle) {
  b->twi.after_rise = phase;
  plan(b, TWI_WAIT_HIGH, NEVER);
  put(b, b->twi.sda_low, false, cycle);
}

void twi_line_moved(avr_board *b, uint64_t cycle) {
  if (b->twi.phase == TWI_WAIT_HIGH && is_high(b, SCL_MASK)) {
    plan(b, b->twi.after_rise, cycle + half_period(b));
  } else if (b->twi.phase == TWI_WAIT_FREE) {
    wait_for_free_bus(b, cycle);
  }
}

void twi_due(avr_board *b, uint64_t cycle) {
  twi_state *t = &b->twi;
  const uint64_t half = half_period(b);
  switch (t->phase) {
    case TWI_BIT_SET:
      plan(b, TWI_BIT_RISE, t->fallen + half);
      put(b, !bit_to_send(t), true, cycle);
      break;
    case TWI_BIT_RISE:
      raise_clock(b, TWI_BIT_FALL, cycle);
      break;
    case TWI_BIT_FALL:
      end_bit(b, cycle);
      break;
    case TWI_RESTART_RISE:
      raise_clock(b, TWI_START_FALL, cycle);
      break;
    case TWI_START_FALL:
      plan(b, TWI_START_HOLD, cycle + half);
      put(b, true, false, cycle);
      break;
    case TWI_START_HOLD:
      put(b, true, true, cycle);
      complete(b, t->owner ? STATUS_REPEATED_START : STATUS_START);
      t->owner = true;
      break;
    case TWI_STOP_RISE:
      raise_clock(b, TWI_STOP_END, cycle);
      break;
    case TWI_STOP_END:
      t->owner = false;
      t->control &= (uint8_t)~TWSTO;
      t->status = STATUS_NONE;
      plan(b, TWI_IDLE, NEVER);
      put(b, false, false, cycle);
      if (t->control & TWSTA) wait_for_free_bus(b, cycle);
      break;
    case TWI_IDLE:
    case TWI_WAIT_HIGH:
    case TWI_WAIT_FREE:
      break;
  }
}

/* The program has cleared TWINT, or set TWSTA on an idle interface: what its control bits ask for begins. */
static void begin(avr_board *b, uint64_t cycle) {
  twi_state *t = &b->twi;
  if (!t->owner) {
    t->control &= (uint8_t)~TWSTO; /* there is nothing to stop */
    t->status = STATUS_NONE;
    if (t->control & TWSTA) wait_for_free_bus(b, cycle);
  } else if (t->control & TWSTO) {
    put(b, true, true, cycle);
    plan(b, TWI_STOP_RISE, cycle + half_period(b));
  } else if (t->control & TWSTA) {
    put(b, false, true, cycle);
    plan(b, TWI_RESTART_RISE, cycle + half_period(b));
  } else {
    begin_byte(b, cycle);
  }
}

/* ---- registers ---- */

static bool flag_is_set(const avr_board *b) { return b->core.raised & FLAG(VECTOR_TWI); }

static void switch_off(avr_board *b, uint64_t cycle) {
  port_state *p = &b->port[PORT_C];
  const uint8_t others = (uint8_t) ~(SDA_MASK | SCL_MASK);
  b->twi.owner = false;
  b->twi.status = STATUS_NONE;
  plan(b, TWI_IDLE, NEVER);
  p->forced &= others;
  p->forced_out &= others;
  p->forced_in &= others;
  pins_update(b, PORT_C, cycle);
}

static void write_control(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  twi_state *t = &b->twi;
  const bool was_on = t->control & TWEN;
  const uint8_t writable = TWEA | TWSTA | TWSTO | TWEN | TWIE;
  const bool stopping = t->phase == TWI_STOP_RISE || t->phase == TWI_STOP_END ||
                        (t->phase == TWI_WAIT_HIGH && t->after_rise == TWI_STOP_END);
  t->control = (uint8_t)((value & writable) | (t->control & TWWC) | (stopping ? TWSTO : 0));
  enable_interrupt(b, VECTOR_TWI, value & TWIE);
  if (value & TWINT) clear_flag(b, VECTOR_TWI);
  if (!(value & TWEN)) {
    if (was_on) switch_off(b, end);
    return;
  }
  if (!was_on) put(b, false, false, end);
  if (t->phase == TWI_IDLE && !flag_is_set(b) && ((value & TWINT) || (!t->owner && (value & TWSTA)))) begin(b, end);
}

static uint8_t read_control(avr_board *b, uint16_t address, uint64_t cycle) {
  return (uint8_t)(b->twi.control | (flag_is_set(b) ? TWINT : 0));
}

static uint8_t read_status(avr_board *b, uint16_t address, uint64_t cycle) {
  return (uint8_t)((flag_is_set(b) ? b->twi.status : STATUS_NONE) | b->twi.prescaler);
}

static void write_status(avr_board *b, uint16_t address, uint8_t value, uint64_t end) { b->twi.prescaler = value & 3u; }

static void write_rate(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  b->core.data[address] = value;
  b->twi.rate = value;
}

static uint8_t read_data(avr_board *b, uint16_t address, uint64_t cycle) { return b->twi.data; }

/* While an operation is under way the register does not take a byte, and says so. */
static void write_data(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  twi_state *t = &b->twi;
  if (flag_is_set(b)) {
    t->control &= (uint8_t)~TWWC;
    t->data = value;
  } else {
    if (value != t->data) note(b, b->core.pc, "writes to", "TWDR", "it is dropped: TWINT is not set (22.9.4)");
    t->control |= TWWC;
  }
}

void twi_reset(avr_board *b) {
  b->twi = (twi_state){.data = 0xFF, .status = STATUS_NONE};
  b->core.data[REG_TWAR] = 0xFE;
  plan(b, TWI_IDLE, NEVER);
}

void twi_init(avr_board *b) {
  on_write(b, REG_TWBR, write_rate);
  on_read(b, REG_TWSR, read_status);
  on_write(b, REG_TWSR, write_status);
  on_read(b, REG_TWDR, read_data);
  on_write(b, REG_TWDR, write_data);
  on_read(b, REG_TWCR, read_control);
  on_write(b, REG_TWCR, write_control);
}
