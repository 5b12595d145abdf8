/* avr_registers.c: the one table of the ATmega328P's I/O registers (36), with what of each is not built, and the notes
 * that the board keeps where a program asks for it.
 *
 * A write that changes a bit which is not built does nothing more than to change that bit; a register that the chip does
 * not have keeps nothing. The first of them is noted, with its place and cycle. Only registers with such bits are looked
 * at: the others take no longer.
 */
#include <string.h>

#include "avr_parts.h"

static const char DIGITAL[] = "not built: digital inputs stay on";
static const char SLAVE[] = "slave modes of the two-wire interface are not built: no address is answered";

typedef struct chip_register {
  uint8_t address;
  uint8_t missing; /* bits that are not built */
  bool answers;    /* what is read there would come from what is not built */
  const char *name, *why;
} chip_register;

/* Those that are not built, or not whole. Any other register of the chip is one that a unit claims, or one of KEPT. */
/* clang-format off */
static const chip_register REGISTERS[] = {
  {0x43, 0x80, false, "GTCCR", "TSM is not built: the prescalers run on"},
  {0x50, 0x7F, true, "ACSR", "the analog comparator is not built: it stays off"},
  {0x53, 0x0E, false, "SMCR", "sleep modes other than idle are not built: it sleeps in idle mode"},
  {0x55, 0x63, false, "MCUCR", "vectors in the boot section and BODS are not built"},
  {0x61, 0x0F, false, "CLKPR", "the clock's prescaler is not built: the clock stays at 16 MHz"},
  {0x64, 0xEF, false, "PRR", "power reduction is not built: all units run on"},
  {0x66, 0xFF, false, "OSCCAL", "the internal oscillator is not built: the clock is the crystal's 16 MHz"},
  {0x78, 0xFF, false, "ADCL", "it is read-only"}, {0x79, 0xFF, false, "ADCH", "it is read-only"},
  {0x7B, 0x47, false, "ADCSRB", "triggers of the ADC other than free running are not built, nor is the comparator"},
  {0x7E, 0x3F, false, "DIDR0", DIGITAL}, {0x7F, 0x03, false, "DIDR1", DIGITAL},
  {0xB6, 0x60, false, "ASSR", "the asynchronous clock of timer 2 is not built: it runs on the system's"},
  {REG_TWAR, 0xFF, false, "TWAR", SLAVE}, {0xBD, 0xFE, false, "TWAMR", SLAVE},
  {0xC0, 0x01, false, "UCSR0A", "the multi-processor mode (MPCM0) is not built: every frame is received"},
  {0xC1, 0x05, false, "UCSR0B", "the ninth bit of the USART is not built"},
  {0xC2, 0xF0, false, "UCSR0C", "parity, synchronous and SPI mode of the USART are not built"},
};
/* clang-format on */

/* GPIOR0 to 2, SPL, SPH, SREG, PCMSK0 and 1. */
static const uint8_t KEPT[] = {0x3E, 0x4A, 0x4B, 0x5D, 0x5E, 0x5F, 0x6B, 0x6C};

/* Of the same thing, `address` tells one from the other, or NO_ADDRESS. */
static void keep_note(avr_board *b, uint32_t place, uint32_t address, const char *does, const char *what,
                      const char *why) {
  board_notes *all = &b->notes;
  for (size_t i = 0; i < all->count; i++) {
    const board_note *n = &all->notes[i];
    if (n->does == does && n->what == what && n->why == why && (place == NO_ADDRESS || place == n->address)) return;
  }
  if (all->count == BOARD_NOTES_MAXIMUM) return;
  all->notes[all->count++] = (board_note){b->core.cycle, address, does, what, why};
}

void note(avr_board *b, uint32_t address, const char *does, const char *what, const char *why) {
  keep_note(b, NO_ADDRESS, address, does, what, why);
}

void note_place(avr_board *b, uint32_t address, const char *does, const char *what, const char *why) {
  keep_note(b, address, address, does, what, why);
}

static void write_kept(avr_board *b, uint16_t address, uint8_t value, uint64_t end) { b->core.data[address] = value; }

static void write_not_whole(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  const chip_register *r = b->unbuilt[address];
  if ((value ^ b->core.data[address]) & r->missing) note(b, b->core.pc, "writes to", r->name, r->why);
  b->behind[address](b, address, value, end);
}

static uint8_t read_unbuilt(avr_board *b, uint16_t address, uint64_t cycle) {
  const chip_register *r = b->unbuilt[address];
  note(b, b->core.pc, "reads", r->name, r->why);
  return b->core.data[address];
}

static void write_reserved(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  if (value) note(b, b->core.pc, "writes to", "a reserved address", "the ATmega328P has no register there");
}

void on_read(avr_board *b, uint16_t address, avr_register_read *read) {
  // cppcheck-suppress AssignmentAddressToInteger  // a function's type is taken for what it returns
  b->core.reads[address] = read;
}

void on_write(avr_board *b, uint16_t address, avr_register_write *write) { b->core.writes[address] = write; }

void on_ones(avr_board *b, uint16_t address) { b->core.ones |= UINT32_C(1) << (address - AVR_IO_BEGIN); }

/* ---- registers of interrupt flags: a bit is read, a 1 clears it ---- */

/* Bit n is the flag of vectors[n]; 0: there is none. */
static const struct {
  uint8_t address, vectors[8];
} FLAGS[] = {
    {REG_TIFR0, {VECTOR_TIMER0_OVF, VECTOR_TIMER0_COMPA, VECTOR_TIMER0_COMPB}},
    {REG_TIFR1, {VECTOR_TIMER1_OVF, VECTOR_TIMER1_COMPA, VECTOR_TIMER1_COMPB, 0, 0, VECTOR_TIMER1_CAPT}},
    {REG_TIFR2, {VECTOR_TIMER2_OVF, VECTOR_TIMER2_COMPA, VECTOR_TIMER2_COMPB}},
    {REG_PCIFR, {VECTOR_PCINT0, VECTOR_PCINT1, VECTOR_PCINT2}},
    {REG_EIFR, {VECTOR_INT0, VECTOR_INT1}},
};

#define FLAG_REGISTERS (sizeof FLAGS / sizeof *FLAGS)

static uint8_t vector_of(uint16_t address, unsigned bit) {
  size_t i = 0;
  while (FLAGS[i].address != address) i++;
  return FLAGS[i].vectors[bit];
}

static uint8_t read_flags(avr_board *b, uint16_t address, uint64_t cycle) {
  uint8_t value = 0;
  for (unsigned bit = 0; bit < 8; bit++) {
    const uint8_t vector = vector_of(address, bit);
    if (!vector) continue;
    timer_state *timer = timer_of_vector(b, vector);
    if (timer) timer_bring_up(timer, cycle);
    if (b->core.raised & FLAG(vector)) value |= (uint8_t)(1u << bit);
  }
  return value;
}

static void write_flags(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  for (unsigned bit = 0; bit < 8; bit++) {
    const uint8_t vector = vector_of(address, bit);
    if (!vector || !(value >> bit & 1)) continue;
    timer_state *timer = timer_of_vector(b, vector);
    if (timer) timer_bring_up(timer, end - 1);
    clear_flag(b, vector);
    if (timer) timer_plan(timer);
  }
}

void registers_init(avr_board *b) {
  for (uint16_t address = AVR_IO_BEGIN; address < AVR_RAM_BEGIN; address++) {
    if (!memchr(KEPT, address, sizeof KEPT)) on_write(b, address, write_reserved);
  }
  for (size_t i = 0; i < sizeof REGISTERS / sizeof *REGISTERS; i++) {
    const chip_register *r = &REGISTERS[i];
    b->unbuilt[r->address] = r;
    on_write(b, r->address, write_kept);
    if (r->answers) on_read(b, r->address, read_unbuilt);
  }
  for (size_t i = 0; i < FLAG_REGISTERS; i++) {
    on_read(b, FLAGS[i].address, read_flags);
    on_write(b, FLAGS[i].address, write_flags);
    on_ones(b, FLAGS[i].address);
  }
}

void registers_complete(avr_board *b) {
  for (size_t i = 0; i < sizeof REGISTERS / sizeof *REGISTERS; i++) {
    const uint8_t address = REGISTERS[i].address;
    b->behind[address] = b->core.writes[address];
    on_write(b, address, write_not_whole);
  }
}
