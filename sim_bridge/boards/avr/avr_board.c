/* avr_board.c: run loop, interrupts and resets of the emulated ATmega328P, and its place behind board.h.
 *
 * The loop keeps lockstep with the outside: it never waits for the host's clock, counts every cycle, and lets simavr's
 * core run exactly to the next event or to the end of the call. An instruction is never split: what is due while it
 * runs happens, at its own cycle, before the next one. Interrupts are taken between instructions: 4 cycles, 4 more from
 * sleep (12.7), and one instruction always runs after SEI, RETI and a write that sets I.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#include "avr_board.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "avr_parts.h"
#include "sim_core.h"

#define INTERRUPT_CYCLES 4u
#define WAKE_UP_CYCLES 4u
#define SLEEP_ENABLED 0x01u /* SMCR.SE */

#define RESERVED_RAMPZ 0x5Bu /* where larger AVRs have RAMPZ */
#define Z_RANGE 0x10000u

enum { RESET_FLAG_POWER = 1, RESET_FLAG_EXTERNAL = 2, RESET_FLAG_BROWN_OUT = 4, RESET_FLAG_WATCHDOG = 8 }; /* MCUSR */

/* ---- what is due ---- */

/* Lets the core stop after the instruction that it executes. */
static void stop_core(avr_board *b) { b->avr->run_cycle_count = 0; }

void set_due(avr_board *b, due_source source, uint64_t cycle) {
  uint64_t before = b->due[source];
  b->due[source] = cycle;
  if (cycle <= b->next_due) {
    b->next_due = cycle;
    avr_t *avr = b->avr;
    uint64_t room = cycle > avr->cycle ? cycle - avr->cycle : 0;
    if (room < avr->run_cycle_count) avr->run_cycle_count = room;
  } else if (before == b->next_due) {
    b->next_due = NEVER;
    for (int i = 0; i < DUE_COUNT; i++) {
      if (b->due[i] < b->next_due) b->next_due = b->due[i];
    }
  }
}

static void happen(avr_board *b, due_source source, uint64_t cycle) {
  switch (source) {
    case DUE_DRIVEN_EDGE:
      pins_due_driven(b, cycle);
      break;
    case DUE_SEEN_EDGE:
      pins_due_seen(b, cycle);
      break;
    case DUE_NOISE_FILTER:
      pins_due_noise_filter(b, cycle);
      break;
    case DUE_TIMER0:
    case DUE_TIMER1:
    case DUE_TIMER2:
      timer_due(&b->timer[source - DUE_TIMER0], cycle);
      break;
    case DUE_TRANSMITTER:
      usart_due_transmitter(b, cycle);
      break;
    case DUE_OUTSIDE:
      usart_due_outside(b, cycle);
      break;
    case DUE_RECEIVER:
      usart_due_receiver(b, cycle);
      break;
    case DUE_CONVERTER:
      converter_due(b, cycle);
      break;
    case DUE_WATCHDOG:
      watchdog_due(b, cycle);
      break;
    case DUE_EEPROM:
      eeprom_due(b);
      break;
    case DUE_TWI:
      twi_due(b, cycle);
      break;
    case DUE_COUNT:
      break;
  }
}

/* Everything that is due until `cycle`, in the order of time. */
static void catch_up(avr_board *b, uint64_t cycle) {
  while (b->next_due <= cycle) {
    due_source source = DUE_DRIVEN_EDGE;
    while (b->due[source] != b->next_due) source++;
    if (b->next_due > b->clock) b->clock = b->next_due;
    happen(b, source, b->clock);
  }
  if (cycle > b->clock) b->clock = cycle;
}

uint64_t begin_access(avr_board *b) {
  const avr_t *avr = b->avr;
  unsigned opcode = avr->flash[avr->pc] | (unsigned)avr->flash[avr->pc + 1] << 8;
  bool one_cycle = (opcode & 0xF000) == 0xB000 /* IN, OUT */ || (opcode & 0xFD00) == 0x9900 /* SBIC, SBIS */;
  uint64_t cycle = avr->cycle + (one_cycle ? 0 : 1);
  catch_up(b, cycle);
  return cycle;
}

/* ---- interrupts ---- */

void interrupts_changed(avr_board *b) {
  if ((b->raised & b->enabled) && b->avr->sreg[S_I]) stop_core(b);
}

void raise_flag(avr_board *b, uint8_t vector) {
  b->raised |= FLAG(vector);
  interrupts_changed(b);
}

void clear_flag(avr_board *b, uint8_t vector) { b->raised &= ~FLAG(vector); }

void enable_interrupt(avr_board *b, uint8_t vector, bool enabled) {
  b->enabled = enabled ? b->enabled | FLAG(vector) : b->enabled & ~FLAG(vector);
  interrupts_changed(b);
}

/* What the hardware does to the flag when the interrupt is executed. */
static void acknowledge(avr_board *b, uint8_t vector) {
  timer_state *timer = timer_of_vector(b, vector);
  if (timer) timer_bring_up(timer, b->avr->cycle);
  bool is_state =
      vector == VECTOR_USART_RX || vector == VECTOR_USART_UDRE || vector == VECTOR_EE_READY || vector == VECTOR_TWI;
  if (!is_state) clear_flag(b, vector);
  if (timer) timer_plan(timer);
  if (vector == VECTOR_WDT) watchdog_acknowledged(b);
  if (vector == VECTOR_INT0 || vector == VECTOR_INT1) pins_acknowledged(b, vector);
}

/* Executes the most urgent pending interrupt, if there is one. */
static bool enter_interrupt(avr_board *b) {
  avr_t *avr = b->avr;
  uint32_t pending = b->raised & b->enabled;
  if (!pending && !avr_has_pending_interrupts(avr)) return false;
  if (pending) {
    uint8_t vector = (uint8_t)__builtin_ctz(pending);
    acknowledge(b, vector);
    _avr_push_addr(avr, avr->pc);
    avr_sreg_set(avr, S_I, 0);
    avr->pc = (avr_flashaddr_t)vector * avr->vector_size;
  } else { /* one of simavr's own modules; they are less urgent than all of ours */
    avr->interrupt_state = 1;
    avr_service_interrupts(avr);
    if (avr->sreg[S_I]) return false; /* it was masked meanwhile */
  }
  avr->cycle += INTERRUPT_CYCLES + (b->sleeping ? WAKE_UP_CYCLES : 0);
  b->sleeping = false;
  b->counters.executed_cycles += INTERRUPT_CYCLES;
  b->counters.interrupts++;
  return true;
}

/* simavr tells of RETI; the instruction after it runs even if I was set before. */
static void on_reti(struct avr_irq_t *irq, uint32_t value, void *param) {
  avr_board *b = param;
  (void)irq;
  (void)value;
  if (b->avr->sreg[S_I]) b->avr->interrupt_state = -1;
}

/* ---- faults ---- */

static void crash(avr_board *b, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(b->fault, sizeof b->fault, format, arguments);
  va_end(arguments);
  b->crashed = true;
}

void refuse(avr_board *b, const char *what) {
  crash(b, "the program uses %s, which is not built, in cycle %llu", what, (unsigned long long)b->avr->cycle);
  stop_core(b);
}

static void on_bad_opcode(struct avr_irq_t *irq, uint32_t opcode, void *param) {
  avr_board *b = param;
  (void)irq;
  crash(b, "the program reached the invalid instruction 0x%04X at address 0x%04X in cycle %llu", (unsigned)opcode,
        (unsigned)b->avr->pc, (unsigned long long)b->avr->cycle);
  b->avr->state = cpu_Crashed;
}

static void say_nothing(avr_t *avr, const int level, const char *format, va_list arguments) {
  (void)avr;
  (void)level;
  (void)format;
  (void)arguments;
}

/* ---- run loop ---- */

static uint64_t earlier(uint64_t a, uint64_t b) { return a < b ? a : b; }

static uint64_t next_of_simavr(const avr_t *avr) {
  return avr->cycle_timers.timer ? avr->cycle_timers.timer->when : NEVER;
}

static void execute(avr_board *b, uint64_t until) {
  avr_t *avr = b->avr;
  uint64_t start = avr->cycle;
  if (avr->interrupt_state < 0) {
    avr->interrupt_state = 0;
    avr->run_cycle_count = 1; /* one instruction */
  } else {
    avr->run_cycle_count = until - start;
  }
  avr_flashaddr_t pc = avr_run_one(avr);
  b->counters.executed_cycles += avr->cycle - start;
  if (avr->state == cpu_Sleeping) {
    b->sleeping = avr->data[REG_SMCR] & SLEEP_ENABLED;
    avr->state = cpu_Running;
  } else if (avr->state != cpu_Running) {
    if (!b->crashed) crash(b, "the program ran off the end of the flash in cycle %llu", (unsigned long long)avr->cycle);
    return;
  }
  avr->pc = pc;
}

static void restart(avr_board *b);

static board_state advance(board *self, uint64_t until) {
  avr_board *b = (avr_board *)self;
  avr_t *avr = b->avr;
  while (avr->cycle < until) {
    catch_up(b, avr->cycle);
    if (b->reset_wanted) restart(b);
    if (b->held) {
      avr->cycle = earlier(until, b->next_due);
      continue;
    }
    if (b->crashed) return BOARD_CRASHED;
    if (next_of_simavr(avr) <= avr->cycle) avr_cycle_timer_process(avr);
    if (b->reset_wanted) continue;
    if (avr->sreg[S_I] && avr->interrupt_state >= 0 && enter_interrupt(b)) continue;
    uint64_t horizon = earlier(until, earlier(b->next_due, next_of_simavr(avr)));
    if (b->sleeping) {
      avr->cycle = horizon;
    } else {
      execute(b, horizon);
    }
  }
  catch_up(b, avr->cycle); /* from here on "now" is what `now` says */
  return b->crashed ? BOARD_CRASHED : BOARD_RUNNING;
}

/* ---- reset ---- */

void want_reset(avr_board *b, board_reset_cause cause) {
  b->reset_wanted |= (uint8_t)(1u << cause);
  stop_core(b);
}

/* What is in RAM and registers when the power comes is anything: here another anything at each power-on of a run, the
 * same in each run. */
static void scramble_memory(avr_board *b) {
  uint32_t x = 0x328u + (uint32_t)b->counters.resets * 0x9E3779B9u;
  for (size_t i = 0; i < BOARD_DATA_SIZE; i++) {
    x = x * 1664525u + 1013904223u;
    b->avr->data[i] = (uint8_t)(x >> 24);
  }
}

void halt_cpu(avr_board *b, unsigned cycles) {
  b->avr->cycle += cycles;
  stop_core(b);
}

static void restart(avr_board *b) {
  avr_t *avr = b->avr;
  uint64_t cycle = avr->cycle;
  uint8_t causes = b->reset_wanted;
  uint8_t flags = avr->data[REG_MCUSR];
  if (causes & (1u << BOARD_RESET_EXTERNAL)) flags |= RESET_FLAG_EXTERNAL;
  if (causes & (1u << BOARD_RESET_BROWN_OUT)) flags |= RESET_FLAG_BROWN_OUT;
  if (causes & (1u << BOARD_RESET_WATCHDOG)) flags |= RESET_FLAG_WATCHDOG;
  if (causes & (1u << BOARD_RESET_POWER)) {
    flags = RESET_FLAG_POWER;
    scramble_memory(b);
  }
  b->reset_wanted = 0;
  b->counters.resets++;
  b->crashed = false;
  b->sleeping = false;
  b->raised = 0;
  b->enabled = 0;
  b->timer_base[0] = b->timer_base[1] = cycle;
  avr_reset(avr); /* clears the I/O registers, and simavr's clock with its timers */
  avr->cycle = cycle;
  avr->data[REG_MCUSR] = flags;
  timers_reset(b, cycle);
  usart_reset(b);
  twi_reset(b);
  converter_reset(b);
  watchdog_reset(b, cycle);
  eeprom_reset(b, causes & (1u << BOARD_RESET_POWER | 1u << BOARD_RESET_BROWN_OUT));
  pins_reset(b, cycle);
}

/* ---- registers ---- */

void on_read(avr_board *b, uint16_t address, avr_io_read_t read, void *param) {
  avr_register_io_read(b->avr, address, read, param);
}

void on_write(avr_board *b, uint16_t address, avr_io_write_t write, void *param) {
  avr_register_io_write(b->avr, address, write, param);
}

void on_bit_write(avr_board *b, uint16_t address, avr_io_write_bit_t write, void *param) {
  avr_register_io_bit_write(b->avr, address, write, param);
}

static uint8_t read_flags(avr_t *avr, avr_io_addr_t address, void *param) {
  const flag_register *self = param;
  (void)avr;
  (void)address;
  uint64_t cycle = begin_access(self->owner);
  uint8_t value = 0;
  for (unsigned bit = 0; bit < 8; bit++) {
    if (!self->vectors[bit]) continue;
    timer_state *timer = timer_of_vector(self->owner, self->vectors[bit]);
    if (timer) timer_bring_up(timer, cycle);
    if (self->owner->raised & FLAG(self->vectors[bit])) value |= (uint8_t)(1u << bit);
  }
  return value;
}

static void write_flags(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  const flag_register *self = param;
  (void)avr;
  (void)address;
  uint64_t cycle = begin_access(self->owner);
  for (unsigned bit = 0; bit < 8; bit++) {
    if (!self->vectors[bit] || !(value >> bit & 1)) continue;
    timer_state *timer = timer_of_vector(self->owner, self->vectors[bit]);
    if (timer) timer_bring_up(timer, cycle);
    clear_flag(self->owner, self->vectors[bit]);
    if (timer) timer_plan(timer);
  }
}

static int write_flag_bit(avr_t *avr, uint8_t bit, uint8_t value, void *param) {
  if (value) write_flags(avr, 0, (uint8_t)(1u << bit), param);
  return 1;
}

void add_flag_register(avr_board *b, uint16_t address, const uint8_t vectors[8]) {
  flag_register *self = &b->flag_registers[b->flag_register_count++];
  self->owner = b;
  memcpy(self->vectors, vectors, sizeof self->vectors);
  on_read(b, address, read_flags, self);
  on_write(b, address, write_flags, self);
  on_bit_write(b, address, write_flag_bit, self);
}

/* MCUSR: flags can only be cleared. */
static void write_reset_flags(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  (void)param;
  avr->data[address] &= value;
}

static void ignore_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  (void)avr;
  (void)address;
  (void)value;
  (void)param;
}

/* ---- construction ---- */

/* WDR arrives as a request to all of simavr's modules. */
static int on_request(avr_io_t *io, uint32_t request, void *param) {
  (void)param;
  if (request != AVR_IOCTL_WATCHDOG_RESET) return -1;
  watchdog_kick((avr_board *)io->avr->custom.data);
  return 0;
}

/* simavr calls these two by name: which modules an ATmega328P has. Of simavr's own it keeps program memory; SPI and the
 * analog comparator answer nothing. */
void mx8_init(struct avr_t *avr) {
  avr_board *b = avr->custom.data;
  struct mcu_t *chip = (struct mcu_t *)avr;
  b->avr = avr;
  b->io.kind = "board";
  b->io.ioctl = on_request;
  avr_flash_init(avr, &chip->selfprog);
  avr_register_io(avr, &b->io);
  on_write(b, REG_MCUSR, write_reset_flags, b);
  on_write(b, RESERVED_RAMPZ, ignore_write, b);
  pins_init(b);
  timers_init(b);
  usart_init(b);
  twi_init(b);
  converter_init(b);
  watchdog_init(b);
  eeprom_init(b);
}

void mx8_reset(struct avr_t *avr) {
  avr_irq_register_notify(avr->irq + AVR_CORE_BAD_OPCODE, on_bad_opcode, avr->custom.data);
  avr_irq_register_notify(avr->interrupts.irq + AVR_INT_IRQ_RUNNING, on_reti, avr->custom.data);
}

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
  free(b);
}

/* ---- the other operations ---- */

static uint64_t now(const board *self) { return ((const avr_board *)self)->avr->cycle; }

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
  if (!strcmp(name, AVR_BOARD_FLASH)) return b->avr->flash;
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

board *avr_board_create(const uint8_t *elf, size_t size, char *error, size_t error_size) {
  avr_global_logger_set(say_nothing);
  avr_board *b = calloc(1, sizeof *b);
  avr_t *avr = b ? avr_make_mcu_by_name("atmega328p") : NULL;
  if (!avr) {
    free(b);
    snprintf(error, error_size, "there is no memory for an emulated board");
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
  if (!image_load(b, elf, size, error, error_size)) {
    destroy(&b->base);
    return NULL;
  }
  usart_line_rate(b, 500000);
  b->reset_wanted = 1u << BOARD_RESET_POWER;
  restart(b);
  b->counters = (board_counters){0};
  return &b->base;
}
