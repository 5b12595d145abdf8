/* avr_board.c: the emulated ATmega328P's place behind board.h: its registers, its construction, the operations.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#include "avr_board.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "avr_parts.h"

#define RESERVED_RAMPZ 0x5Bu /* where larger AVRs have RAMPZ */
#define Z_RANGE 0x10000u

/* MCUSR: flags can only be cleared. */
static void write_reset_flags(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  if (value & ~b->avr->data[address])
    note(b, b->avr->pc, "writes 1 to", "MCUSR", "its flags can only be cleared (11.9.1)");
  b->avr->data[address] &= value;
}

/* ---- construction ---- */

/* WDR arrives as a request to all of simavr's modules. */
static int on_request(avr_io_t *io, uint32_t request, void *param) {
  if (request != AVR_IOCTL_WATCHDOG_RESET) return -1;
  watchdog_kick((avr_board *)io->avr->custom.data);
  return 0;
}

/* simavr calls these two by name: which modules an ATmega328P has. Of simavr's own it keeps program memory; the analog
 * comparator answers nothing. */
void mx8_init(struct avr_t *avr) {
  avr_board *b = avr->custom.data;
  struct mcu_t *chip = (struct mcu_t *)avr;
  b->avr = avr;
  b->io.kind = "board";
  b->io.ioctl = on_request;
  avr_flash_init(avr, &chip->selfprog);
  avr_register_io(avr, &b->io);
  registers_init(b);
  on_write(b, REG_MCUSR, write_reset_flags);
  pins_init(b);
  timers_init(b);
  usart_init(b);
  twi_init(b);
  spi_init(b);
  converter_init(b);
  watchdog_init(b);
  eeprom_init(b);
}

void mx8_reset(struct avr_t *avr) { hear_core(avr->custom.data); }

/* simavr follows a program that reads or writes program memory beyond its end: with room for every address that fits
 * into Z, and no RAMPZ, it stays within what is ours. */
static void enlarge_flash(avr_t *avr) {
  uint8_t *flash = realloc(avr->flash, Z_RANGE);
  if (!flash) abort();
  memset(flash + AVR_BOARD_FLASH_SIZE, 0xFF, Z_RANGE - AVR_BOARD_FLASH_SIZE);
  avr->flash = flash;
}

static void destroy(board *self) {
  avr_board *b = (avr_board *)self;
  avr_t *avr = b->avr;
  if (avr) {
    for (int i = 0; i < avr->interrupts.vector_count; i++) {
      avr_free_irq(avr->interrupts.vector[i]->irq, AVR_INT_IRQ_COUNT);
    }
    avr_free_irq(avr->interrupts.irq, AVR_INT_IRQ_COUNT);
    avr_terminate(avr);
    free((void *)avr->data_names);
    avr_free_irq(avr->irq, AVR_CORE_IRQ_COUNT);
    free((void *)avr->irq_pool.irq);
    free(avr);
  }
  pins_free(b);
  usart_free(b);
  watchdog_free(b);
  spans_free(b);
  debug_free(b);
  free(b->written);
  free(b->covered);
  free(b);
}

/* ---- operations ---- */

static uint64_t now(const board *self) { return ((const avr_board *)self)->avr->cycle; }

static board_state advance(board *self, uint64_t until) { return run_until((avr_board *)self, until); }

static void drive(board *self, uint64_t at, uint8_t pin, uint8_t level) {
  pins_drive((avr_board *)self, at, pin, level);
}

static uint8_t output(const board *self, uint8_t pin) { return pins_output((const avr_board *)self, pin); }

static void analog(board *self, board_analog_source *source, void *context) {
  avr_board *b = (avr_board *)self;
  b->converter.source = source;
  b->converter.context = context;
}

static void send(board *self, uint64_t at, const uint8_t *bytes, size_t count) {
  usart_send((avr_board *)self, at, bytes, count);
}

static size_t receive(board *self, uint8_t *bytes, uint64_t *cycles, size_t capacity) {
  return usart_receive((avr_board *)self, bytes, cycles, capacity);
}

static void line_rate(board *self, uint32_t baud) { usart_line_rate((avr_board *)self, baud); }

static void reset(board *self, board_reset_cause cause) { want_reset((avr_board *)self, cause); }

static void hold(board *self, bool held) {
  avr_board *b = (avr_board *)self;
  if (held && !b->held) want_reset(b, BOARD_RESET_BROWN_OUT);
  b->held = held;
}

static void counters(const board *self, board_counters *out) { *out = ((const avr_board *)self)->counters; }

static const char *fault(const board *self) {
  const avr_board *b = (const avr_board *)self;
  return b->crashed ? b->fault : NULL;
}

static void *extension(board *self, const char *name) {
  avr_board *b = (avr_board *)self;
  if (!strcmp(name, BOARD_DATA)) return b->avr->data;
  if (!strcmp(name, BOARD_EEPROM)) return &b->eeprom.face;
  if (!strcmp(name, BOARD_WATCHDOG_LOG)) return &b->watchdog_log;
  if (!strcmp(name, BOARD_NOTES)) return &b->notes;
  if (!strcmp(name, BOARD_PIN_LEVELS)) return pins_levels(b);
  if (!strcmp(name, BOARD_CHECKS)) return &b->checks;
  if (!strcmp(name, BOARD_OUTSIDE_LOG)) return &b->outside_log;
  if (!strcmp(name, BOARD_LINE_OFF)) return &b->usart.line_off;
  if (!strcmp(name, BOARD_PROGRAM_COUNTER)) return &b->avr->pc;
  if (!strcmp(name, BOARD_FAULT_ADDRESS)) {
    return b->crashed && b->fault_address != NO_ADDRESS ? &b->fault_address : NULL;
  }
  return NULL;
}

static const board_operations OPERATIONS = {
    .version = BOARD_INTERFACE_VERSION,
    .kind = "avr",
    .destroy = destroy,
    .now = now,
    .advance = advance,
    .drive = drive,
    .output = output,
    .analog = analog,
    .send = send,
    .receive = receive,
    .line_rate = line_rate,
    .reset = reset,
    .hold = hold,
    .counters = counters,
    .fault = fault,
    .extension = extension,
};

uint8_t *avr_board_cover(board *self) {
  avr_board *b = (avr_board *)self;
  if (!b->covered) b->covered = calloc(1, AVR_BOARD_FLASH_SIZE / 2u);
  return b->covered;
}

void avr_board_one_by_one(board *self) { ((avr_board *)self)->one_by_one = true; }

/* Of what simavr says of a program, only that an address was "wrapped" is news. */
static void hear_simavr(avr_t *avr, const int level, const char *format, va_list arguments) {
  if (!strstr(format, "Wrapping")) return;
  note(avr->custom.data, avr->pc, "reads or writes", "behind the memory's end",
       "nothing is there; here it is RAM again");
}

/* A program that begins in the boot section has its reset there (27.6: the fuse BOOTRST). */
static void load(avr_board *b, const avr_program *program) {
  memcpy(b->avr->flash, program->flash, AVR_BOARD_FLASH_SIZE);
  memcpy(b->eeprom.cells, program->eeprom, BOARD_EEPROM_SIZE);
  b->code_end = program->code_end;
  b->variables_end = program->variables_end;
  b->avr->reset_pc = program->begin;
  if (program->begin == 0) b->code_begin = 1; /* address 0 is for resets: a jump there is noticed */
}

board *avr_board_create(const avr_program *program) {
  avr_global_logger_set(hear_simavr);
  avr_board *b = calloc(1, sizeof *b);
  avr_t *avr = b ? avr_make_mcu_by_name("atmega328p") : NULL;
  if (!avr) {
    free(b);
    return NULL;
  }
  b->base.op = &OPERATIONS;
  b->next_due = NEVER;
  for (int i = 0; i < DUE_COUNT; i++) b->due[i] = NEVER;
  avr->custom.data = b;
  avr->frequency = BOARD_CLOCK_HZ;
  avr->rampz = RESERVED_RAMPZ;
  avr_init(avr);
  enlarge_flash(avr);
  memset(avr->serial, 0, sizeof avr->serial); /* simavr's is another one each time */
  load(b, program);
  usart_line_rate(b, 500000);
  b->reset_wanted = 1u << BOARD_RESET_POWER;
  restart(b);
  b->counters = (board_counters){0};
  return &b->base;
}
