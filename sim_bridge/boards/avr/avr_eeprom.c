/* avr_eeprom.c: the EEPROM (8.4, 8.6): EECR, EEAR, EEDR.
 *
 * A write: EEMPE, within four cycles EEPE; the CPU stands still for two cycles, and 3.4 ms later EEPE clears itself. A
 * read: EERE; the CPU stands still for four cycles, the byte is in EEDR. While a write is under way there is no other
 * write, no read, and EEAR cannot be changed; while flash is written there is no write. Erasing makes a cell 0xFF, writing
 * clears bits.
 *
 * A reset does not stop a write as long as there is supply (8.4.2).
 */
#include <string.h>

#include "avr_parts.h"

#define CYCLES_PER_MS (BOARD_CLOCK_HZ / 1000u)
#define ERASE_AND_WRITE_CYCLES (CYCLES_PER_MS * 34u / 10u) /* table 8-1 */
#define ONE_OF_BOTH_CYCLES (CYCLES_PER_MS * 18u / 10u)
#define ARMED_CYCLES 4u /* how long EEMPE stays set */
#define WRITE_HALT_CYCLES 2u
#define READ_HALT_CYCLES 4u

enum { EEPM = 0x30, EERIE = 0x08, EEMPE = 0x04, EEPE = 0x02, EERE = 0x01 };
enum { MODE_ERASE_AND_WRITE = 0x00, MODE_ERASE = 0x10, MODE_WRITE = 0x20 }; /* EEPM */

static const char BUSY[] = "it is dropped: a write is under way (8.6.3)";

static uint8_t result_of(uint8_t mode, uint8_t old, uint8_t value) {
  if (mode == MODE_ERASE) return 0xFF;
  return mode == MODE_WRITE ? old & value : value;
}

static void start_write(avr_board *b, uint8_t mode, uint64_t cycle) {
  eeprom_state *e = &b->eeprom;
  e->armed_until = 0;
  e->writing = true;
  e->mode = mode;
  e->address = e->selected;
  e->value = result_of(mode, e->cells[e->address], e->data);
  bool both = mode != MODE_ERASE && mode != MODE_WRITE; /* the fourth is reserved */
  set_due(b, DUE_EEPROM, cycle + (both ? ERASE_AND_WRITE_CYCLES : ONE_OF_BOTH_CYCLES));
  halt_cpu(b, WRITE_HALT_CYCLES);
  flash_gives_way(b);
}

static void end_write(avr_board *b) {
  b->eeprom.writing = false;
  set_due(b, DUE_EEPROM, NEVER);
  memories_changed(b);
}

void eeprom_due(avr_board *b, uint64_t cycle) {
  b->eeprom.cells[b->eeprom.address] = b->eeprom.value;
  end_write(b);
}

static uint8_t read_control(avr_board *b, uint16_t address, uint64_t cycle) {
  uint8_t value = b->core.data[address] & (EEPM | EERIE);
  if (cycle < b->eeprom.armed_until) value |= EEMPE;
  if (b->eeprom.writing) value |= EEPE;
  return value;
}

static void write_control(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  eeprom_state *e = &b->eeprom;
  uint8_t mode = (e->writing ? b->core.data[address] : value) & EEPM;
  bool armed = end <= e->armed_until;
  b->core.data[address] = mode | (value & EERIE);
  enable_interrupt(b, VECTOR_EE_READY, value & EERIE);
  if (armed && (value & EEPE) && !e->writing) {
    if (b->programming.busy) {
      note(b, b->core.pc, "sets", "EEPE", "it is dropped: flash is being written (8.6.3)");
    } else {
      start_write(b, mode, end);
    }
    return;
  }
  if ((value & EEPE) && !e->writing)
    note(b, b->core.pc, "sets", "EEPE", "it is dropped: EEMPE was not set just before (8.6.3)");
  if ((value & EERE) && e->writing) note(b, b->core.pc, "sets", "EERE", BUSY);
  if ((value & EEMPE) && (e->writing || !(value & EEPE))) e->armed_until = end + ARMED_CYCLES;
  if ((value & EERE) && !e->writing) {
    e->data = e->cells[e->selected];
    halt_cpu(b, READ_HALT_CYCLES);
  }
}

static void write_address(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  eeprom_state *e = &b->eeprom;
  unsigned high = address == REG_EEARH ? value & (BOARD_EEPROM_SIZE / 256u - 1u) : e->selected >> 8;
  unsigned low = address == REG_EEARH ? e->selected & 0xFFu : value;
  const uint16_t selected = (uint16_t)(high << 8 | low);
  if (e->writing && selected != e->selected) note(b, b->core.pc, "writes to", "EEAR", BUSY);
  if (!e->writing) e->selected = selected;
}

static uint8_t read_address(avr_board *b, uint16_t address, uint64_t cycle) {
  return (uint8_t)(address == REG_EEARH ? b->eeprom.selected >> 8 : b->eeprom.selected);
}

static void write_data(avr_board *b, uint16_t address, uint8_t value, uint64_t end) { b->eeprom.data = value; }

static uint8_t read_data(avr_board *b, uint16_t address, uint64_t cycle) { return b->eeprom.data; }

void eeprom_reset(avr_board *b, bool power_failed) {
  eeprom_state *e = &b->eeprom;
  uint8_t *cell = &e->cells[e->address];
  if (e->writing && power_failed) {
    *cell = board_damaged_cell(&e->face, *cell, e->value);
    e->writing = false;
  }
  e->armed_until = 0;
  e->data = 0;
  if (e->writing) {
    b->core.data[REG_EECR] = e->mode; /* EEPM: not reset while a write is under way */
  } else {
    end_write(b);
  }
}

void eeprom_init(avr_board *b) {
  memset(b->eeprom.cells, 0xFF, sizeof b->eeprom.cells);
  b->eeprom.face.bytes = b->eeprom.cells;
  on_read(b, REG_EECR, read_control);
  on_write(b, REG_EECR, write_control);
  on_read(b, REG_EEDR, read_data);
  on_write(b, REG_EEDR, write_data);
  on_read(b, REG_EEARL, read_address);
  on_write(b, REG_EEARL, write_address);
  on_read(b, REG_EEARH, read_address);
  on_write(b, REG_EEARH, write_address);
}
