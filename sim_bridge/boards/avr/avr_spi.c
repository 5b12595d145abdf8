/* avr_spi.c: the serial peripheral interface as a master (19), edge by edge on SS (PB2, pin 10), MOSI (PB3, pin 11), MISO
 * (PB4, pin 12) and SCK (PB5, pin 13).
 *
 * A byte written to SPDR takes 16 half periods of SCK from the end of the write on; SCK has an edge at the end of each.
 * The leading edge is the first of each two. With CPHA = 0 MISO is sampled at leading edges and MOSI changes at trailing
 * ones, its first bit being there at once; with CPHA = 1 it is the other way round (table 19-2). SPIF is set with the last
 * edge. Where the data sheet does not say: MOSI keeps its last bit between two bytes.
 *
 * Not built: the slave mode.
 */
#include "avr_parts.h"

#define HALVES 16 /* of a byte */

enum { SPIE = 0x80, SPE = 0x40, DORD = 0x20, MSTR = 0x10, CPOL = 0x08, CPHA = 0x04, SPR = 0x03 }; /* SPCR */
enum { SPIF = 0x80, WCOL = 0x40, SPI2X = 0x01 };                                                  /* SPSR */
enum { SS = 0x04, MOSI = 0x08, MISO = 0x10, SCK = 0x20 };                                         /* of port B */

static bool is_on(const avr_board *b) { return b->spi.control & SPE; }

static bool is_master(const avr_board *b) { return is_on(b) && (b->spi.control & MSTR); }

/* Table 19-5, in cycles. */
static uint64_t half_period(const spi_state *s) {
  static const uint8_t halves[4] = {2, 8, 32, 64};
  return halves[s->control & SPR] >> s->doubled;
}

static void plan(avr_board *b, uint64_t cycle) { set_due(b, DUE_SPI, cycle); }

/* The pins as the unit has them (table 19-1). */
static void put(avr_board *b, uint64_t cycle) {
  const spi_state *s = &b->spi;
  port_state *p = &b->port[PORT_B];
  const bool clock = ((s->control & CPOL) != 0) != (s->half & 1);
  p->shifted = is_master(b) ? MOSI | SCK : 0;
  p->shifted_level = (uint8_t)(((s->bit ? MOSI : 0) | (clock ? SCK : 0)) & p->shifted);
  p->forced_in = 0;
  if (is_on(b)) p->forced_in = is_master(b) ? MISO : MOSI | SCK | SS;
  pins_update(b, PORT_B, cycle);
}

/* ---- a byte ---- */

static void complete(avr_board *b) {
  b->spi.half = HALVES;
  b->spi.seen &= (uint8_t)~SPIF;
  plan(b, NEVER);
  raise_flag(b, VECTOR_SPI);
}

static void set_up_bit(spi_state *s) {
  s->bit = s->control & DORD ? s->out & 1 : s->out >> 7;
  s->out = (uint8_t)(s->control & DORD ? s->out >> 1 : s->out << 1);
}

static void sample_bit(avr_board *b) {
  spi_state *s = &b->spi;
  const bool level = b->port[PORT_B].level & MISO;
  s->in = (uint8_t)(s->control & DORD ? s->in >> 1 | level << 7 : s->in << 1 | level);
}

/* A half period ends: an edge of SCK. */
void spi_due(avr_board *b, uint64_t cycle) {
  spi_state *s = &b->spi;
  s->half++;
  if ((s->half & 1) != ((s->control & CPHA) != 0)) {
    sample_bit(b);
  } else if (s->half < HALVES) {
    set_up_bit(s);
  }
  if (s->half == HALVES) {
    s->data = s->in;
    complete(b);
  } else {
    plan(b, cycle + half_period(s));
  }
  put(b, cycle);
}

/* SS as an input that is low: another master wants the bus (19.3.2). */
void spi_pins_moved(avr_board *b, uint64_t cycle) {
  const port_state *p = &b->port[PORT_B];
  if (!is_master(b) || ((p->out | p->level) & SS)) return;
  note(b, b->core.pc, "is SPI master with", "SS (pin 10) as an input that is low", "MSTR is cleared (19.3.2)");
  b->spi.control &= (uint8_t)~MSTR;
  complete(b);
  put(b, cycle);
}

/* ---- registers ---- */

/* Flags that were read as 1 are cleared by the next access to SPDR (19.5.2). */
static void clear_seen(avr_board *b) {
  spi_state *s = &b->spi;
  if (s->seen & SPIF) clear_flag(b, VECTOR_SPI);
  if (s->seen & WCOL) s->collided = false;
  s->seen = 0;
}

static uint8_t read_control(avr_board *b, uint16_t address, uint64_t cycle) { return b->spi.control; }

static void write_control(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  spi_state *s = &b->spi;
  if ((value & SPE) && !(value & MSTR)) {
    note(b, b->core.pc, "writes to", "SPCR", "the slave mode of the SPI is not built: no transfer ends");
  }
  s->control = value;
  enable_interrupt(b, VECTOR_SPI, value & SPIE);
  if (!is_master(b)) {
    s->half = HALVES;
    plan(b, NEVER);
  }
  put(b, end);
  spi_pins_moved(b, end);
}

static uint8_t read_status(avr_board *b, uint16_t address, uint64_t cycle) {
  spi_state *s = &b->spi;
  s->seen = (uint8_t)((b->core.raised & FLAG(VECTOR_SPI) ? SPIF : 0) | (s->collided ? WCOL : 0));
  return (uint8_t)(s->seen | (s->doubled ? SPI2X : 0));
}

static void write_status(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  b->spi.doubled = value & SPI2X;
}

static uint8_t read_data(avr_board *b, uint16_t address, uint64_t cycle) {
  clear_seen(b);
  return b->spi.data;
}

static void write_data(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  spi_state *s = &b->spi;
  clear_seen(b);
  if (s->half < HALVES) {
    note(b, b->core.pc, "writes to", "SPDR", "it is dropped: a transfer is under way (WCOL, 19.5.2)");
    s->collided = true;
  } else if (is_master(b)) {
    s->out = value;
    s->half = 0;
    if (!(s->control & CPHA)) set_up_bit(s);
    plan(b, end + half_period(s));
    put(b, end);
  } else if (!is_on(b)) {
    note(b, b->core.pc, "writes to", "SPDR", "nothing is sent: the SPI is off (SPE in SPCR)");
  }
}

void spi_reset(avr_board *b) {
  b->spi = (spi_state){.half = HALVES};
  plan(b, NEVER);
}

void spi_init(avr_board *b) {
  on_read(b, REG_SPCR, read_control);
  on_write(b, REG_SPCR, write_control);
  on_read(b, REG_SPSR, read_status);
  on_write(b, REG_SPSR, write_status);
  on_read(b, REG_SPDR, read_data);
  on_write(b, REG_SPDR, write_data);
}
