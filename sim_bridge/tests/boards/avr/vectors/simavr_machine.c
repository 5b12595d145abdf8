/* simavr_machine.c: machine.h by simavr: its ATmega328P without peripherals, so that I/O registers store and do nothing else.
 *
 * What simavr does wrong is put right here, by the AVR instruction set manual (DS40002198):
 * - Its release 1.6 (2017; Debian 12's libsimavr-dev) skips two words where ADIW or SBIW of some constants is skipped, which
 *   have one (section "ADIW - Add Immediate to Word").
 * - It executes EIJMP, EICALL and ELPM although it says that this chip has none, and then reads behind its flash (the
 *   ATmega328P's data sheet, section 31, lists none of them). Here they end where it says so.
 *
 * A program made of this and of simavr is under simavr's licence, GPL-3.0-or-later; it is made when somebody records again,
 * and is no part of what is installed. */
#include "machine.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "instructions.h"
#include "sim_avr.h"
#include "sim_core.h"

static avr_t *avr;
static jmp_buf no_instruction;

/* simavr calls these by name: which peripherals an ATmega328P has. */
void mx8_init(struct avr_t *mcu);
void mx8_reset(struct avr_t *mcu);
void mx8_init(struct avr_t *mcu) { (void)mcu; }
void mx8_reset(struct avr_t *mcu) { (void)mcu; }

static void hear(avr_t *who, const int level, const char *format, va_list arguments) {
  (void)who, (void)level, (void)arguments;
  if (strstr(format, "Invalid Opcode")) longjmp(no_instruction, 1);
}

void machine_create(void) {
  avr_global_logger_set(hear);
  avr = avr_make_mcu_by_name("atmega328p");
  if (!avr || avr_init(avr) != 0) abort();
  avr->frequency = 16000000;
}

uint8_t *machine_data(void) { return avr->data; }

void machine_write_flash(uint32_t address, uint16_t word) {
  avr->flash[address] = (uint8_t)word;
  avr->flash[address + 1] = (uint8_t)(word >> 8);
}

void machine_set(const machine_state *state) {
  avr->pc = state->pc;
  avr->cycle = state->cycle;
  avr->state = cpu_Running;
  for (int bit = 0; bit < 8; bit++) avr->sreg[bit] = state->flags >> bit & 1;
}

machine_state machine_get(void) {
  machine_state state = {.pc = (uint32_t)avr->pc, .cycle = avr->cycle};
  for (int bit = 0; bit < 8; bit++) state.flags |= (uint8_t)(avr->sreg[bit] << bit);
  return state;
}

static unsigned word_at(uint32_t address) { return avr->flash[address] | (unsigned)avr->flash[address + 1] << 8; }

/* Behind the instruction at `pc`, which began in `cycle`. */
static void put_skip_right(uint32_t pc, uint64_t cycle) {
  const unsigned next = word_at(pc + 2);
  const bool may_be = avr->pc == pc + 6 && avr->cycle == cycle + 3 && (next & 0xFE00u) == 0x9600u; /* ADIW, SBIW */
  const instruction *which = may_be ? instruction_of((uint16_t)word_at(pc)) : NULL;
  if (which && (which->needs == SKIP || which->needs == PORT_SKIP)) avr->pc -= 2, avr->cycle--;
}

bool machine_run(uint64_t until) {
  if (setjmp(no_instruction)) return false;
  do {
    avr->state = cpu_Running; /* nothing wakes it from SLEEP */
    avr->run_cycle_count = 1; /* one instruction */
    avr->interrupt_state = 0;
    const uint32_t pc = (uint32_t)avr->pc;
    const uint64_t cycle = avr->cycle;
    avr->pc = avr_run_one(avr);
    if (avr->state == cpu_Crashed) return false; /* it was outside of the flash */
    put_skip_right(pc, cycle);
  } while (avr->cycle < until);
  return true;
}

bool machine_go_round(void) {
  do {
    if (!machine_run(machine_get().cycle + 1)) return false;
  } while (machine_get().pc != 0);
  return true;
}
