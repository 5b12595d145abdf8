/* avr_flash.c: self-programming (27): SPMCSR, SPM, and LPM where it reads fuses, lock bits and the signature.
 *
 * A write to SPMCSR with SPMEN says what the SPM that follows within four cycles does. One that fills a word of the page
 * buffer is done at once. A page is erased, or the buffer written into it, in 4.5 ms (27.8.12, the longest); writing clears
 * bits. Meanwhile, and until RWWSRE is written or a page load begins, flash below AVR_NRWW_BEGIN cannot be read (RWWSB): a program that
 * goes there stops. A page from there on halts the CPU until it is done (27.4).
 *
 * Fuses and lock bits are an Uno's whose boot section is where the image begins, with nothing locked. Not built: writing
 * lock bits.
 */
#include <string.h>

#include "avr_parts.h"

#define PAGE_CYCLES (BOARD_CLOCK_HZ / 10000u * 45u)
#define PAGE_WORDS (AVR_PAGE_SIZE / 2u)
#define ARMED_CYCLES 4u /* how long SPMEN stays set without SPM; for LPM one less (27.9.1) */

enum {
  SPMIE = 0x80,
  RWWSB = 0x40,
  SIGRD = 0x20,
  RWWSRE = 0x10,
  BLBSET = 0x08,
  PGWRT = 0x04,
  PGERS = 0x02,
  SPMEN = 0x01
};
enum { EMPTY = 0xFF, Z = 30 };

static uint16_t z_of(const avr_board *b) { return (uint16_t)(b->core.data[Z] | b->core.data[Z + 1] << 8); }

/* SPMCSR as it reads. While it is 0, LPM is nothing but a reading of flash. */
static uint8_t show(avr_board *b) {
  const flash_state *f = &b->programming;
  return b->core.data[REG_SPMCSR] = (uint8_t)(f->control | (f->blocked ? RWWSB : 0));
}

static void block(avr_board *b, bool blocked) {
  b->programming.blocked = blocked;
  b->core.code_begin = blocked ? AVR_NRWW_BEGIN : b->code_begin;
}

/* SPMEN clears itself. */
static void disarm(avr_board *b) {
  flash_state *f = &b->programming;
  f->control &= SPMIE;
  f->busy = false;
  set_due(b, DUE_FLASH, NEVER);
  show(b);
  raise_flag(b, VECTOR_SPM_READY);
}

void flash_forget_page(avr_board *b) { memset(b->programming.buffer, EMPTY, sizeof b->programming.buffer); }

/* ---- a page ---- */

static void begin_page(avr_board *b, uint16_t address) {
  flash_state *f = &b->programming;
  f->busy = true;
  f->page = address & (AVR_FLASH_SIZE - AVR_PAGE_SIZE);
  set_due(b, DUE_FLASH, b->core.cycle + 1 + PAGE_CYCLES);
  if (f->page >= AVR_NRWW_BEGIN) {
    halt_cpu(b, PAGE_CYCLES);
  } else {
    block(b, true);
  }
  show(b);
}

static void end_page(avr_board *b) {
  const flash_state *f = &b->programming;
  uint8_t *page = b->core.flash + f->page;
  if (f->control & PGERS) memset(page, EMPTY, AVR_PAGE_SIZE);
  for (unsigned i = 0; (f->control & PGWRT) && i < AVR_PAGE_SIZE; i++) page[i] &= f->buffer[i];
  if (f->control & PGWRT) flash_forget_page(b);
  avr_core_flash_changed(&b->core, f->page, AVR_PAGE_SIZE);
}

void flash_due(avr_board *b, uint64_t cycle) {
  if (b->programming.busy) end_page(b);
  disarm(b);
}

/* Each word once, until the buffer is erased (27.8.2). */
static void fill_word(avr_board *b, uint16_t address) {
  uint8_t *word = b->programming.buffer + (address & (AVR_PAGE_SIZE - 2u));
  if (word[0] != EMPTY || word[1] != EMPTY) return;
  memcpy(word, b->core.data, 2); /* r1:r0 */
}

/* SPM. */
void flash_store(avr_board *b) {
  const flash_state *f = &b->programming;
  if (b->core.pc < AVR_NRWW_BEGIN) {
    note(b, b->core.pc, "executes", "SPM", "it is dropped: it works in the boot section only (27.3.2)");
    return;
  }
  if (f->busy || !(f->control & SPMEN)) return;
  if (f->control & (PGERS | PGWRT)) {
    begin_page(b, z_of(b));
    return;
  }
  if (f->control & BLBSET) {
    note(b, b->core.pc, "sets", "lock bits", "not built: nothing is locked");
  } else if (!(f->control & SIGRD)) {
    block(b, false);
    if (f->control & RWWSRE) {
      flash_forget_page(b);
    } else {
      fill_word(b, z_of(b));
    }
  }
  disarm(b);
}

/* ---- LPM ---- */

/* Extended, high and low fuse byte of an Uno; the boot section is where the image begins, if it begins there (27.6). */
static uint8_t fuse_or_lock(const avr_board *b, uint16_t address) {
  const uint32_t begin = b->reset_address;
  const unsigned size = begin >= 0x7E00 ? 3 : begin >= 0x7C00 ? 2 : begin >= 0x7800 ? 1 : 0; /* BOOTSZ, table 27-13 */
  const uint8_t high = (uint8_t)(begin ? 0xD8u | size << 1 : 0xDFu);
  const uint8_t bytes[4] = {0xFF, 0xFF, 0xFD, high}; /* low fuse, lock bits, extended, high (27.8.9) */
  return address < sizeof bytes ? bytes[address] : 0xFF;
}

/* Table 27-7. */
static uint8_t signature(uint16_t address) {
  static const uint8_t row[6] = {0x1E, 0x80, 0x95, 0xFF, 0x0F, 0xFF}; /* the second: calibration of the oscillator */
  return address < sizeof row ? row[address] : 0xFF;
}

uint8_t flash_load(avr_board *b, uint16_t address) {
  const flash_state *f = &b->programming;
  const uint8_t control = f->control;
  const bool armed = (control & SPMEN) && !f->busy && b->core.cycle + 1 < b->due[DUE_FLASH];
  if (armed && (control & (BLBSET | SIGRD))) {
    disarm(b);
    return control & BLBSET ? fuse_or_lock(b, address) : signature(address);
  }
  if (f->blocked && address < AVR_NRWW_BEGIN) {
    note(b, b->core.pc, "reads", "flash that is being written", "it cannot be read while RWWSB is set (27.8.6)");
    return EMPTY;
  }
  return address < AVR_FLASH_SIZE ? b->core.flash[address] : EMPTY;
}

/* ---- SPMCSR ---- */

static uint8_t read_control(avr_board *b, uint16_t address, uint64_t cycle) { return show(b); }

static void write_control(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  flash_state *f = &b->programming;
  const uint8_t action = value & (RWWSRE | BLBSET | PGWRT | PGERS);
  if (b->eeprom.writing && (value & SPMEN)) {
    note(b, b->core.pc, "writes to", "SPMCSR", "it is dropped: the EEPROM is being written (27.8.8)");
    return;
  }
  f->control = (uint8_t)((f->control & ~SPMIE) | (value & SPMIE));
  if (!f->busy && (value & SPMEN) && !(action & (action - 1u))) { /* one of them at most */
    f->control = value & (uint8_t)~RWWSB;
    clear_flag(b, VECTOR_SPM_READY);
    set_due(b, DUE_FLASH, end + ARMED_CYCLES);
  }
  show(b);
  enable_interrupt(b, VECTOR_SPM_READY, value & SPMIE);
}

/* A page that is under way is finished. */
void flash_reset(avr_board *b) {
  if (b->programming.busy) end_page(b);
  flash_forget_page(b);
  block(b, false);
  b->programming.control = 0;
  disarm(b);
}

void flash_init(avr_board *b) {
  on_read(b, REG_SPMCSR, read_control);
  on_write(b, REG_SPMCSR, write_control);
}
