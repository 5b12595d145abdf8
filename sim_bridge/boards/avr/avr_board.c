/* avr_board.c: the emulated ATmega328P's place behind board.h: its registers, its construction, the operations.
 */
#include "avr_board.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "avr_parts.h"

/* MCUSR: flags can only be cleared. */
static void write_reset_flags(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  if (value & ~b->core.data[address])
    note(b, b->core.pc, "writes 1 to", "MCUSR", "its flags can only be cleared (11.9.1)");
  b->core.data[address] &= value;
}

static void destroy(board *self) {
  avr_board *b = (avr_board *)self;
  avr_core_free(&b->core);
  pins_free(b);
  usart_free(b);
  watchdog_free(b);
  spans_free(b);
  debug_free(b);
  free(b->core.written);
  free(b->core.covered);
  free(b);
}

/* ---- operations ---- */

static uint64_t now(const board *self) { return ((const avr_board *)self)->core.cycle; }

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
  if (!strcmp(name, BOARD_DATA)) return b->core.data;
  if (!strcmp(name, BOARD_EEPROM)) return &b->eeprom.face;
  if (!strcmp(name, BOARD_WATCHDOG_LOG)) return &b->watchdog_log;
  if (!strcmp(name, BOARD_NOTES)) return &b->notes;
  if (!strcmp(name, BOARD_PIN_LEVELS)) return pins_levels(b);
  if (!strcmp(name, BOARD_CHECKS)) return &b->checks;
  if (!strcmp(name, BOARD_OUTSIDE_LOG)) return &b->outside_log;
  if (!strcmp(name, BOARD_LINE_OFF)) return &b->usart.line_off;
  if (!strcmp(name, BOARD_PROGRAM_COUNTER)) return &b->core.pc;
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
  if (!b->core.covered) b->core.covered = calloc(1, AVR_FLASH_SIZE / 2u);
  return b->core.covered;
}

void avr_board_no_fast_forward(board *self) { ((avr_board *)self)->no_fast_forward = true; }

/* ---- construction ---- */

static void join_units(avr_board *b) {
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
  flash_init(b);
  registers_complete(b);
}

static void load(avr_board *b, const avr_program *program) {
  memcpy(b->core.flash, program->flash, AVR_FLASH_SIZE);
  memcpy(b->eeprom.cells, program->eeprom, BOARD_EEPROM_SIZE);
  b->variables_end = program->variables_end;
  b->high_fuse = program->high_fuse;
  b->reset_address = AVR_RESET_BEGIN(program->high_fuse);
  avr_core_flash_changed(&b->core, 0, AVR_FLASH_SIZE);
  flash_code_ends(b, program->code_end);
}

board *avr_board_create(const avr_program *program) {
  avr_board *b = calloc(1, sizeof *b);
  if (!b || !avr_core_create(&b->core)) {
    free(b);
    return NULL;
  }
  b->base.op = &OPERATIONS;
  b->core.calls = &CALLS_OF_CORE;
  b->core.owner = b;
  for (int i = 0; i < DUE_COUNT; i++) b->due[i] = NEVER;
  join_units(b);
  load(b, program);
  usart_line_rate(b, 500000);
  b->reset_wanted = 1u << BOARD_RESET_POWER;
  restart(b);
  b->counters = (board_counters){0};
  return &b->base;
}
