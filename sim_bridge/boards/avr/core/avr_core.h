/* avr_core.h: the CPU of an ATmega328P: its data memory, its flash, and every instruction of the AVRe+ core with its
 * cycles ("AVR Instruction Set Manual").
 *
 * What is in flash is decoded once into small records (avr_decode.c) and executed from them (avr_execute.c). The core
 * knows nothing of timers and pins: its owner joins them by one table of registers, and says when something is due next.
 *
 * When something happens. Times are CPU cycles; "at cycle t" means at the clock edge with which cycle t begins. An
 * instruction that starts at c and takes n cycles reads and writes I/O registers in cycle c + 1 (IN, OUT, SBIC and SBIS
 * in their only one, c), and what it wrote takes effect one cycle later. Whatever is due until the cycle of an access has
 * happened before the access.
 */
#ifndef AVR_CORE_H
#define AVR_CORE_H

#include <stdbool.h>
#include <stdint.h>

#include "avr_chip.h"

typedef struct avr_board avr_board; /* the owner; the core hands its address on */

/* A decoded instruction: four bytes, so that a program's stay in the host's nearest cache. */
typedef struct {
  uint8_t kind; /* of avr_decode.h */
  uint8_t d;    /* register; of one bit of an I/O register its mask; of SREG the number of its bit */
  uint16_t k;   /* second register, constant, mask of a bit, or address: of data, or of program in words */
} avr_instruction;

/* Flags as the numbers they follow from: most are never looked at, so that bits are made only when they are. */
typedef struct {
  uint32_t c, t, i; /* 0 or 1 */
  uint32_t z;       /* Z is set if this is 0 */
  uint32_t n, v, s; /* bit 7 of each */
  uint32_t h;       /* H is bit 4 */
} avr_flags;

/* What the program reads at an I/O register, at `cycle`. */
typedef uint8_t avr_register_read(avr_board *owner, uint16_t address, uint64_t cycle);

/* The program writes to an I/O register, which takes effect at `end`. */
typedef void avr_register_write(avr_board *owner, uint16_t address, uint8_t value, uint64_t end);

/* What the owner does for the core, or is to know of its program. `pc` is then the address of the instruction at hand, `cycle`
 * that of its beginning. A function may be missing where the owner has no use for it. */
typedef struct {
  void (*happen)(avr_board *owner, uint64_t cycle);                   /* all that is due until then */
  void (*watchdog_reset)(avr_board *owner);                           /* WDR */
  void (*store_program)(avr_board *owner);                            /* SPM */
  uint8_t (*load_program)(avr_board *owner, uint16_t address);        /* LPM while SPMCSR is not 0 */
  void (*left_stack)(avr_board *owner, uint32_t pc, uint16_t before); /* see `stack_floor`; `cycle`: of its end */
  void (*never_written)(avr_board *owner);                            /* it reads RAM that `written` does not have */
  void (*beyond_memory)(avr_board *owner);                            /* it reads or writes from AVR_DATA_SIZE on */
  void (*runs_erased)(avr_board *owner);                              /* an instruction that is 0xFFFF */
  void (*cannot_go_on)(avr_board *owner, unsigned opcode);            /* that is no instruction */
} avr_owner_calls;

typedef struct {
  uint8_t data[AVR_DATA_SIZE]; /* I/O registers as last read or written; SREG is in `flags` */
  uint8_t *flash;              /* AVR_FLASH_SIZE; after a change of it: avr_core_flash_changed */
  avr_instruction *code;       /* of each word that an address may be of; no code is behind flash */
  avr_flags flags;
  uint32_t pc;    /* byte address of the next instruction, which may be behind flash, and then it stops there */
  uint64_t cycle; /* never goes back */
  uint64_t clock; /* cycle of what is happening now, which may be within an instruction; never goes back */

  uint64_t until;    /* it runs no further than this; what an access changes may bring it nearer */
  uint64_t next_due; /* when `happen` is to be called next */
  uint32_t raised;   /* interrupt flags, by vector */
  uint32_t enabled;  /* interrupts that are enabled, by vector */
  bool one_more;     /* one instruction is executed before an interrupt (7.7.1) */
  bool sleeping;     /* by SLEEP while SE is set */

  /* Instructions are from here to there; what lies outside is never executed, however the program gets there: it stops
   * before it. 1: that at 0 is executed, but a jump to it stops. */
  uint32_t code_begin, code_end;
  uint16_t stack_floor; /* a stack that grows below this, or is anywhere but in RAM, is the owner's affair */

  avr_register_read *reads[AVR_RAM_BEGIN];   /* by address; NULL: what `data` has */
  avr_register_write *writes[AVR_RAM_BEGIN]; /* NULL: `data` has it */
  uint32_t ones; /* I/O registers, by bits of their number, where SBI writes its bit alone and CBI nothing */
  const avr_owner_calls *calls;
  avr_board *owner;
  uint8_t *written; /* by address: RAM that was written since the power came; NULL: not kept */
  uint8_t *covered; /* by word of flash: bit 0, and it went straight on; bit 1, and it went elsewhere; NULL: not kept */
} avr_core;

/* Where it stops, beside `until`. */
typedef struct {
  uint8_t marked[AVR_FLASH_SIZE / 2u]; /* by word of flash; not 0: before the instruction there */
  uint16_t lowest, highest;            /* when the stack pointer is not from here to here */
} avr_stops;

/* What the next instruction does to data memory, registers r0 to r31 aside. */
typedef struct {
  uint16_t first; /* cell */
  uint8_t count;  /* 0: nothing */
  bool writes;    /* else it reads */
} avr_access;

/* A core with erased flash, at cycle 0. False: there is no memory for it. */
bool avr_core_create(avr_core *core);
void avr_core_free(avr_core *core);

/* Decodes anew what flash has from `address` on. */
void avr_core_flash_changed(avr_core *core, uint32_t address, uint32_t bytes);

/* Instructions are from `begin` to `end` from now on. */
void avr_core_set_code(avr_core *core, uint32_t begin, uint32_t end);

/* As by a reset, from `pc` on: I/O registers are 0, the stack is at the end of RAM. */
void avr_core_reset(avr_core *core, uint32_t pc);

uint8_t avr_core_flags(const avr_core *core); /* SREG */
void avr_core_set_flags(avr_core *core, uint8_t sreg);

/* Executes instructions, one at least, until cycle `until` or until something wants it to stop (`until` of the core is then
 * 0); with `stops`, which may be NULL, also there. Returns the address of the last one. */
uint32_t avr_run(avr_core *core, uint64_t until, const avr_stops *stops);

/* Puts the address of the next instruction on the stack and goes on at the interrupt's vector; takes no time by itself. */
void avr_enter_interrupt(avr_core *core, unsigned vector);

avr_access avr_next_access(const avr_core *core);

static inline uint16_t avr_stack(const avr_core *core) {
  return (uint16_t)(core->data[REG_SPL] | core->data[REG_SPH] << 8);
}

static inline bool avr_is_code(const avr_core *core, uint32_t address) {
  return address - core->code_begin < core->code_end - core->code_begin;
}

/* To be called by an access: it stops after the instruction at hand. */
static inline void avr_stop(avr_core *core) { core->until = 0; }

#endif
