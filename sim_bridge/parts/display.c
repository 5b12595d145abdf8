/* display.c: see display.h. */
#include "display.h"

#include <string.h>

#define LONG_S 1.52e-3   /* clear display, return home (table 6) */
#define SHORT_S 37e-6    /* all others */
#define DATA_S 4e-6      /* more, until the address is the next one */
#define POWER_ON_S 10e-3 /* its reset takes as long, behind 4.5 V */
#define PULSE_S 230e-9   /* of E, at least (PW_EH) */
#define LINE_CELLS 40    /* of memory, in each of two lines */
#define CELLS 80
#define SECOND_LINE 0x40u /* address of its first cell */

enum { RS, ENABLE, DB4 }; /* among its pins */

typedef struct {
  part part;
  double oscillator;
  uint8_t pins[DB4 + 4]; /* what the board does to them */
  uint64_t rise;         /* of E */
  uint64_t ready;        /* until then it is busy */
  uint8_t cells[CELLS], glyphs[64];
  uint8_t address; /* the cell, or the row of a glyph */
  bool in_glyphs;
  bool has_4_bits, has_upper; /* the bus; the upper half of a byte is here */
  uint8_t upper;
  bool has_2_lines, is_on, goes_right, shifts;
  int shift; /* by how many cells what is seen is moved to the left */
} display;

/* Inputs but E have pull-ups. */
static bool is_high(const display *self, int i) {
  return self->pins[i] == BOARD_HIGH || (i != ENABLE && self->pins[i] != BOARD_LOW);
}

static void busy(display *self, uint64_t cycle, double seconds) {
  self->ready = cycle + (uint64_t)(seconds / self->oscillator * BOARD_CLOCK_HZ);
}

static void move_window(display *self, int left) {
  const int cells = self->has_2_lines ? LINE_CELLS : CELLS;
  self->shift = (self->shift + left + cells) % cells;
}

static void move_address(display *self, bool right) {
  const uint8_t count = self->in_glyphs ? sizeof self->glyphs : CELLS;
  self->address = (uint8_t)((self->address + (right ? 1u : count - 1u)) % count);
}

/* Cell of an address: of two lines the second one's begin at 0x40. */
static uint8_t cell_of(const display *self, uint8_t address) {
  if (!self->has_2_lines) return (uint8_t)(address % CELLS);
  return (uint8_t)(address % SECOND_LINE % LINE_CELLS + (address & SECOND_LINE ? LINE_CELLS : 0));
}

static void instruct(display *self, uint8_t byte) {
  if (byte & 0x80) {
    self->in_glyphs = false;
    self->address = cell_of(self, byte & 0x7F);
  } else if (byte & 0x40) {
    self->in_glyphs = true;
    self->address = byte & 0x3F;
  } else if (byte & 0x20) { /* function set: DL, N; the font does not show here */
    self->has_4_bits = !(byte & 0x10);
    self->has_2_lines = byte & 0x08;
  } else if (byte & 0x10) { /* cursor or display shift: S/C, R/L */
    if (byte & 0x08) {
      move_window(self, byte & 0x04 ? -1 : 1);
    } else {
      move_address(self, byte & 0x04);
    }
  } else if (byte & 0x08) { /* display on; cursor and blinking do not show here */
    self->is_on = byte & 0x04;
  } else if (byte & 0x04) { /* entry mode: I/D, S */
    self->goes_right = byte & 0x02;
    self->shifts = byte & 0x01;
  } else if (byte) { /* clear display, return home */
    if (byte == 0x01) {
      memset(self->cells, ' ', sizeof self->cells);
      self->goes_right = true;
    }
    self->in_glyphs = false;
    self->address = 0;
    self->shift = 0;
  }
}

static void take(display *self, uint64_t cycle, uint8_t byte) {
  if (!is_high(self, RS)) {
    instruct(self, byte);
    busy(self, cycle, byte < 0x04 ? LONG_S : SHORT_S);
    return;
  }
  (self->in_glyphs ? self->glyphs : self->cells)[self->address] = byte;
  move_address(self, self->goes_right);
  if (self->shifts && !self->in_glyphs) move_window(self, self->goes_right ? 1 : -1);
  busy(self, cycle, SHORT_S + DATA_S);
}

/* Where E falls the bus is read; what comes while it is busy is lost. */
static void read_bus(display *self, uint64_t cycle) {
  if (cycle < self->ready) return;
  uint8_t half = 0;
  for (int i = 0; i < 4; i++) half |= (uint8_t)(is_high(self, DB4 + i) << i);
  if (!self->has_4_bits) {
    take(self, cycle, (uint8_t)(half << 4));
  } else if (self->has_upper) {
    self->has_upper = false;
    take(self, cycle, (uint8_t)(self->upper << 4 | half));
  } else {
    self->has_upper = true;
    self->upper = half;
  }
}

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  display *self = (display *)base;
  const bool before = is_high(self, ENABLE);
  for (int i = 0; i < DB4 + 4; i++) {
    if (base->pins[i].pin == pin) self->pins[i] = level;
  }
  const bool now = is_high(self, ENABLE);
  if (now && !before) self->rise = cycle;
  if (before && !now && (double)(cycle - self->rise) >= PULSE_S * BOARD_CLOCK_HZ) read_bus(self, cycle);
}

static int letters(part *base, uint8_t *codes) {
  const display *self = (const display *)base;
  memset(codes, ' ', DISPLAY_LINES * DISPLAY_LETTERS);
  if (!self->is_on || base->unplugged) return DISPLAY_LINES;
  const int cells = self->has_2_lines ? LINE_CELLS : CELLS;
  for (int line = 0; line < (self->has_2_lines ? 2 : 1); line++) {
    for (int i = 0; i < DISPLAY_LETTERS; i++) {
      codes[line * DISPLAY_LETTERS + i] = self->cells[line * LINE_CELLS + (i + self->shift) % cells];
    }
  }
  return DISPLAY_LINES;
}

static const part_operations OPERATIONS = {.edge = edge, .letters = letters};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  display *self = (display *)base;
  part_pin joined[DB4 + 4];
  self->oscillator = ((const display_parameters *)parameters)->oscillator;
  if (!(self->oscillator > 0.0)) return -1;
  for (int i = 0; i < DB4 + 4; i++) {
    joined[i] = (part_pin){pins[i], PART_HEARS};
    self->pins[i] = BOARD_RELEASED;
  }
  memset(self->cells, ' ', sizeof self->cells);
  self->goes_right = true;
  busy(self, 0, POWER_ON_S);
  part_join(base, &OPERATIONS, place, joined, DB4 + 4);
  return 0;
}

const part_kind display_kind = {.size = sizeof(display), .noise = 280, .pins = DB4 + 4, .init = init};
