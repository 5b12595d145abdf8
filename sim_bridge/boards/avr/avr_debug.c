/* avr_debug.c: see avr_debug.h.
 */
#include "avr_debug.h"

#include <stdlib.h>

#include "avr_parts.h"

#define DATA_BEGIN 0x800000u
#define EEPROM_BEGIN 0x810000u
#define CHANGED "is changed", "by the debugger", "the run cannot be repeated from its record"

struct avr_debugging {
  avr_debug face;
  avr_debugger *call;
  avr_stops stops;
  uint8_t watched[BOARD_DATA_SIZE];
  uint64_t halted_at; /* cycle of the last halt: from there it goes on */
  bool accessed;      /* a watched cell, by the last instruction */
};

/* ---- while it runs ---- */

static bool call(avr_board *b, avr_halt why) {
  avr_debug *d = &b->debug->face;
  d->pc = b->core.pc;
  if (b->debug->call(NULL, why) != 0) return false;
  if (why != AVR_LOOKS && b->core.pc != d->pc) {
    note(b, b->core.pc, CHANGED);
    b->core.pc = d->pc;
  }
  return true;
}

static bool halt(avr_board *b, avr_halt why) {
  struct avr_debugging *g = b->debug;
  g->face.stepping = g->face.interrupted = false;
  g->accessed = false;
  g->halted_at = b->core.cycle;
  return call(b, why);
}

bool debug_looks(avr_board *b) { return call(b, AVR_LOOKS); }

bool debug_crashed(avr_board *b) { return b->debug->halted_at == b->core.cycle || halt(b, AVR_CRASHED); }

bool debug_before(avr_board *b) {
  const struct avr_debugging *g = b->debug;
  const uint32_t pc = b->core.pc;
  if (g->face.interrupted) return halt(b, AVR_INTERRUPTED);
  if (b->core.sleeping || g->halted_at == b->core.cycle) return true;
  if (g->accessed) return halt(b, AVR_WATCHED);
  const bool marked = pc < AVR_FLASH_SIZE && g->stops.marked[pc / 2u];
  return !(marked || g->face.stepping) || halt(b, AVR_TRAPPED);
}

static void look_at_access(const avr_board *b, struct avr_debugging *g) {
  const avr_access access = avr_next_access(&b->core);
  for (unsigned i = 0; i < access.count; i++) {
    const uint16_t cell = (uint16_t)(access.first + i);
    const uint8_t kind = access.writes ? AVR_WATCH_WRITE : AVR_WATCH_READ;
    if (cell >= BOARD_DATA_SIZE || !(g->watched[cell] & kind)) continue;
    g->accessed = true;
    g->face.accessed = cell;
  }
}

uint32_t run_debugged(avr_board *b, uint64_t until) {
  struct avr_debugging *g = b->debug;
  if (g->face.watching) look_at_access(b, g);
  if (g->face.watching || g->face.stepping) until = b->core.cycle + 1;
  return avr_run(&b->core, until, &g->stops);
}

/* ---- from outside ---- */

void debug_free(avr_board *b) {
  free(b->debug);
  b->debug = NULL;
}

avr_debug *avr_board_debug(board *self, avr_debugger *debugger) {
  avr_board *b = (avr_board *)self;
  debug_free(b);
  struct avr_debugging *g = debugger ? calloc(1, sizeof *g) : NULL;
  if (!g) return NULL;
  g->call = debugger;
  g->halted_at = NEVER;
  g->stops.highest = UINT16_MAX;
  g->face.breakpoints = g->stops.marked;
  g->face.watched = g->watched;
  b->debug = g;
  return &g->face;
}

/* As it was but for the value: what a program's reading would change (a byte is taken, a flag is cleared) is put back. */
static uint8_t peek(avr_board *b, uint16_t address) {
  if (address == REG_SREG) return avr_core_flags(&b->core);
  if (address < AVR_IO_BEGIN || address > UINT8_MAX || !b->core.reads[address]) return b->core.data[address];
  const avr_board before = *b;
  const uint8_t value = b->core.reads[address](b, address, b->core.cycle);
  *b = before;
  return value;
}

static void poke(avr_board *b, uint16_t address, uint8_t value) {
  if (address == REG_SREG) {
    avr_core_set_flags(&b->core, value);
  } else if (address >= AVR_IO_BEGIN && address <= UINT8_MAX && b->core.writes[address]) {
    b->core.writes[address](b, address, value, b->core.cycle);
  } else {
    b->core.data[address] = value;
  }
}

int avr_debug_read(board *self, uint32_t address) {
  avr_board *b = (avr_board *)self;
  if (address < AVR_FLASH_SIZE) return b->core.flash[address];
  if (address - DATA_BEGIN < BOARD_DATA_SIZE) return peek(b, (uint16_t)(address - DATA_BEGIN));
  if (address - EEPROM_BEGIN < BOARD_EEPROM_SIZE) return b->eeprom.cells[address - EEPROM_BEGIN];
  return -1;
}

bool avr_debug_write(board *self, uint32_t address, uint8_t value) {
  avr_board *b = (avr_board *)self;
  const int before = avr_debug_read(self, address);
  if (before == value || before < 0) return before == value;
  note(b, b->core.pc, CHANGED);
  if (address < AVR_FLASH_SIZE) {
    b->core.flash[address] = value;
    avr_core_flash_changed(&b->core, address, 1);
    flash_is_another(b);
  } else if (address - DATA_BEGIN < BOARD_DATA_SIZE) {
    poke(b, (uint16_t)(address - DATA_BEGIN), value);
  } else {
    b->eeprom.cells[address - EEPROM_BEGIN] = value;
  }
  return true;
}

void avr_debug_reset(board *self) {
  avr_board *b = (avr_board *)self;
  note(b, b->core.pc, CHANGED);
  want_reset(b, BOARD_RESET_EXTERNAL);
  restart(b);
  b->debug->face.pc = b->core.pc;
}
