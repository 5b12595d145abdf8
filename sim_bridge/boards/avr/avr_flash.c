/* avr_flash.c: self-programming (27): SPMCSR, SPM, and LPM where it reads fuses, lock bits and the signature.
 *
 * A write to SPMCSR with SPMEN says what the SPM that follows within four cycles does. One that fills a word of the page
 * buffer is done at once. A page is erased, or the buffer written into it, in 4.5 ms (27.8.12, the longest); writing clears
 * bits. Meanwhile, and until RWWSRE is written or a page load begins, flash below AVR_NRWW_BEGIN cannot be read (RWWSB):
 * for the core no code is there, and a program that goes there stops. A page from there on halts the CPU until it is done
 * (27.4). SPM works in the boot section only, which is where the fuses say (27.3.2).
 *
 * Fuses and lock bits are an Uno's, but for the high fuse, which the image gives; nothing is locked. Not built: writing lock
 * bits.
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

/* Where instructions can be. Address 0 is for resets, if they lead there: a jump to it is noticed. */
void flash_code_ends(avr_board *b, uint32_t end) {
  const uint32_t begin = b->reset_address == 0;
  avr_core_set_code(&b->core, b->programming.blocked ? AVR_NRWW_BEGIN : begin, end);
}

static void block(avr_board *b, bool blocked) {
  b->programming.blocked = blocked;
  flash_code_ends(b, b->core.code_end);
}

void flash_is_another(avr_board *b) {
  flash_code_ends(b, AVR_FLASH_SIZE);
  b->variables_end = b->core.stack_floor = AVR_RAM_BEGIN;
}

static void show_ready(avr_board *b, uint8_t vector, bool ready) {
  const bool before = b->core.raised & FLAG(vector);
  if (ready != before) (ready ? raise_flag : clear_flag)(b, vector);
}

/* While one of them is written neither interrupt comes (8.6.3, 27.9.1). */
void memories_changed(avr_board *b) {
  const bool ready = !b->eeprom.writing && !b->programming.busy;
  show_ready(b, VECTOR_EE_READY, ready);
  show_ready(b, VECTOR_SPM_READY, ready && !(b->programming.control & SPMEN));
}

/* SPMEN clears itself. */
static void disarm(avr_board *b) {
  flash_state *f = &b->programming;
  f->control &= SPMIE;
  f->busy = false;
  set_due(b, DUE_FLASH, NEVER);
  show(b);
  memories_changed(b);
}

static void forget_page(avr_board *b) { memset(b->programming.buffer, EMPTY, sizeof b->programming.buffer); }

void flash_gives_way(avr_board *b) {
  if (b->programming.control & SPMEN) note(b, b->core.pc, "sets", "EEPE", "the SPM to come is dropped (27.8.8)");
  forget_page(b);
  disarm(b);
}

/* ---- a page ---- */

static void begin_page(avr_board *b, uint16_t address) {
  flash_state *f = &b->programming;
  f->busy = true;
  f->page = address & (AVR_FLASH_SIZE - AVR_PAGE_SIZE);
  memories_changed(b);
  if ((f->control & PGERS) && b->core.pc + 2u - f->page < AVR_PAGE_SIZE)
    note(b, b->core.pc, "erases", "the page that it runs in", "nothing is locked: it goes on in erased flash");
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
  avr_core_flash_changed(&b->core, f->page, AVR_PAGE_SIZE);
  if (f->control & PGWRT) {
    forget_page(b);
    flash_is_another(b);
  }
}

void flash_due(avr_board *b, uint64_t cycle) {
  if (b->programming.busy) end_page(b);
  disarm(b);
}

/* Each word once, until the buffer is erased (27.8.2). */
static void fill_word(avr_board *b, uint16_t address) {
  uint8_t *word = b->programming.buffer + (address & (AVR_PAGE_SIZE - 2u));
  if (word[0] != EMPTY || word[1] != EMPTY) {
    note(b, b->core.pc, "fills", "a word of the page again", "it is dropped: the first one stays (27.8.2)");
    return;
  }
  memcpy(word, b->core.data, 2); /* r1:r0 */
}

/* What SPMCSR asks for. */
static void program(avr_board *b) {
  const flash_state *f = &b->programming;
  if (f->control & (PGERS | PGWRT)) {
    begin_page(b, z_of(b));
    return;
  }
  if (f->control & BLBSET) {
    note(b, b->core.pc, "sets", "lock bits", "not built: nothing is locked");
  } else if (!(f->control & SIGRD)) {
    block(b, false);
    if (f->control & RWWSRE) {
      forget_page(b);
    } else {
      fill_word(b, z_of(b));
    }
  }
  disarm(b);
}

#define ELSEWHERE "it is dropped: it works in the boot section only, which the fuses have from 0x"

/* SPM. */
void flash_store(avr_board *b) {
  static const char *const WHERE[4] = {ELSEWHERE "7000 on (27.3.2)", ELSEWHERE "7800 on (27.3.2)",
                                       ELSEWHERE "7C00 on (27.3.2)", ELSEWHERE "7E00 on (27.3.2)"}; /* by BOOTSZ */
  const flash_state *f = &b->programming;
  const uint32_t pc = b->core.pc;
  if (pc < AVR_BOOT_BEGIN(b->high_fuse)) {
    note(b, pc, "executes", "SPM", WHERE[b->high_fuse >> 1 & 3u]);
  } else if (f->busy) {
    note(b, pc, "executes", "SPM", "it is dropped: a page is being erased or written (27.9.1)");
  } else if (f->control & SPMEN) {
    program(b);
  } else if (!b->eeprom.writing) { /* for which SPMCSR was not written, as is noted */
    note(b, pc, "executes", "SPM", "it is dropped: SPMEN was not set just before, with one other bit at most (27.9.1)");
  }
}

/* ---- LPM ---- */

static uint8_t fuse_or_lock(const avr_board *b, uint16_t address) {
  const uint8_t bytes[4] = {0xFF, 0xFF, 0xFD, b->high_fuse}; /* low fuse, lock bits, extended, high (27.8.9) */
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
    set_due(b, DUE_FLASH, end + ARMED_CYCLES);
    memories_changed(b);
  }
  show(b);
  enable_interrupt(b, VECTOR_SPM_READY, value & SPMIE);
}

/* A page that is under way is finished. */
void flash_reset(avr_board *b) {
  if (b->programming.busy) end_page(b);
  forget_page(b);
  block(b, false);
  b->programming.control = 0;
  disarm(b);
}

void flash_init(avr_board *b) {
  on_read(b, REG_SPMCSR, read_control);
  on_write(b, REG_SPMCSR, write_control);
}
