/* avr_run.c: run loop, interrupts and resets of the emulated ATmega328P.
 *
 * The loop keeps lockstep with the outside: it never waits for the host's clock, counts every cycle, and lets
 * instructions run exactly to the next event or to the end of the call. An instruction is never split: what is due
 * while it runs happens, at its own cycle, before the next one. Interrupts are taken between instructions: 4 cycles, 4
 * more from sleep (12.7), and one instruction always runs after SEI, RETI and a write that sets I.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "avr_instructions.h"
#include "avr_opcodes.h"
#include "avr_parts.h"
#include "sim_core.h"

#define INTERRUPT_CYCLES 4u
#define WAKE_UP_CYCLES 4u
#define SLEEP_ENABLED 0x01u /* SMCR.SE */

enum { RESET_FLAG_POWER = 1, RESET_FLAG_EXTERNAL = 2, RESET_FLAG_BROWN_OUT = 4, RESET_FLAG_WATCHDOG = 8 }; /* MCUSR */

/* ---- what is due ---- */

void stop_core(avr_board *b) { b->avr->run_cycle_count = 0; }

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

static void (*const HAPPENS[DUE_COUNT])(avr_board *b, uint64_t cycle) = {
    [DUE_DRIVEN_EDGE] = pins_due_driven,
    [DUE_SEEN_EDGE] = pins_due_seen,
    [DUE_NOISE_FILTER] = pins_due_noise_filter,
    [DUE_TRANSMITTER] = usart_due_transmitter,
    [DUE_BIT] = usart_due_bit,
    [DUE_OUTSIDE] = usart_due_outside,
    [DUE_RECEIVER] = usart_due_receiver,
    [DUE_CONVERTER] = converter_due,
    [DUE_WATCHDOG] = watchdog_due,
    [DUE_EEPROM] = eeprom_due,
    [DUE_TWI] = twi_due,
    [DUE_SPI] = spi_due,
};

static void happen(avr_board *b, due_source source, uint64_t cycle) {
  if (source >= DUE_TIMER0 && source <= DUE_TIMER2) {
    timer_due(&b->timer[source - DUE_TIMER0], cycle);
  } else {
    HAPPENS[source](b, cycle);
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
  if (b->recorder) spans_requested(b, vector, b->clock);
  interrupts_changed(b);
}

void clear_flag(avr_board *b, uint8_t vector) {
  b->raised &= ~FLAG(vector);
  if (b->recorder) spans_request_gone(b, vector);
}

void enable_interrupt(avr_board *b, uint8_t vector, bool enabled) {
  uint32_t before = b->enabled;
  b->enabled = enabled ? b->enabled | FLAG(vector) : b->enabled & ~FLAG(vector);
  if (b->recorder && b->enabled != before) spans_requested(b, vector, b->clock + 1); /* from the write's end on */
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
    if (b->recorder) spans_accept(b, vector, avr->cycle + (b->sleeping ? WAKE_UP_CYCLES : 0));
    acknowledge(b, vector);
    bool elsewhere = _avr_sp_get(avr) + 1u < b->lowest_stack;
    if (b->written) b->written[_avr_sp_get(avr)] = b->written[_avr_sp_get(avr) - 1u] = 1;
    _avr_push_addr(avr, avr->pc);
    check_stack(b, (uint32_t)avr->pc, elsewhere);
    avr_sreg_set(avr, S_I, 0);
    avr->pc = (avr_flashaddr_t)vector * avr->vector_size;
  } else { /* one of simavr's own modules; they are less urgent than all of ours */
    avr->interrupt_state = 1;
    avr_service_interrupts(avr);
    if (avr->sreg[S_I]) return false; /* it was masked meanwhile */
  }
  avr->cycle += INTERRUPT_CYCLES + (b->sleeping ? WAKE_UP_CYCLES : 0);
  if (b->sleeping) {
    b->sleeping = false;
    if (b->recorder) spans_woke(b);
  }
  b->counters.executed_cycles += INTERRUPT_CYCLES;
  b->counters.interrupts++;
  return true;
}

/* simavr reports RETI; the instruction after it runs even if I was set before. */
static void on_reti(struct avr_irq_t *irq, uint32_t value, void *param) {
  avr_board *b = param;
  if (b->avr->sreg[S_I]) b->avr->interrupt_state = -1;
}

/* ---- faults ---- */

void crash_at(avr_board *b, uint32_t address, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  int used = vsnprintf(b->fault, sizeof b->fault, format, arguments);
  va_end(arguments);
  if (used < 0 || (size_t)used >= sizeof b->fault) used = (int)sizeof b->fault - 1;
  size_t room = sizeof b->fault - (size_t)used;
  if (address == NO_ADDRESS) {
    snprintf(b->fault + used, room, " in cycle %llu", (unsigned long long)b->avr->cycle);
  } else {
    snprintf(b->fault + used, room, " at address 0x%04X in cycle %llu", (unsigned)address,
             (unsigned long long)b->avr->cycle);
  }
  b->fault_address = address;
  b->crashed = true;
}

void check_stack(avr_board *b, uint32_t address, bool set) {
  uint32_t pointer = _avr_sp_get(b->avr), lowest = b->lowest_stack;
  if (set && pointer + 1u >= RAM_BEGIN && pointer + 1u < lowest) {
    note(b, address, "has a stack among", "its variables", "legal, but what it overwrites there is not seen");
    b->lowest_stack = RAM_BEGIN;
  } else if (pointer + 1u < lowest) {
    crash_at(b, address, "the stack overflows: it reaches 0x%04X, variables end below 0x%04X", (unsigned)pointer + 1u,
             (unsigned)lowest);
  } else if (pointer >= BOARD_DATA_SIZE) {
    crash_at(b, address, "the stack pointer leaves the memory: 0x%04X", (unsigned)pointer);
  }
}

/* The board stops if the instruction at `address` has led to where none is. */
static void check_jump(avr_board *b, uint32_t address) {
  uint32_t pc = (uint32_t)b->avr->pc;
  if (b->crashed || is_code(b, pc)) return;
  if (address >= b->code_end) address = b->code_end - 2u; /* it ran straight on, behind the last instruction */
  if (pc == 0 && !is_return(b->avr->flash[address] | (unsigned)b->avr->flash[address + 1] << 8)) {
    note(b, address, "jumps to", "its start",
         "no reset, registers keep their values (a null pointer? an interrupt without a handler?)");
  } else if (pc == 0) {
    crash_at(b, address, "the program returns to its start without a reset");
  } else {
    crash_at(b, address, "the program goes to 0x%04X, but ends at 0x%04X", (unsigned)pc, (unsigned)b->code_end);
  }
}

static void on_bad_opcode(struct avr_irq_t *irq, uint32_t opcode, void *param) {
  avr_board *b = param;
  uint32_t address = (uint32_t)b->avr->pc;
  if (is_code(b, address)) {
    crash_at(b, address, "the program reached the invalid instruction 0x%04X", (unsigned)opcode);
  } else {
    check_jump(b, address);
  }
  b->avr->state = cpu_Crashed;
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

void restart(avr_board *b) {
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
    if (b->written) memset(b->written, 0, BOARD_DATA_SIZE);
  }
  b->reset_wanted = 0;
  b->counters.resets++;
  b->crashed = false;
  b->sleeping = false;
  b->lowest_stack = b->variables_end;
  if (b->recorder) spans_restart(b);
  b->raised = 0;
  b->enabled = 0;
  b->timer_base[0] = b->timer_base[1] = cycle;
  avr_reset(avr); /* clears the I/O registers, and simavr's clock with its timers */
  avr->cycle = cycle;
  avr->data[REG_MCUSR] = flags;
  timers_reset(b, cycle);
  usart_reset(b);
  twi_reset(b);
  spi_reset(b);
  converter_reset(b);
  watchdog_reset(b, cycle);
  eeprom_reset(b, causes & (1u << BOARD_RESET_POWER | 1u << BOARD_RESET_BROWN_OUT));
  pins_reset(b, cycle);
}

/* ---- run loop ---- */

static uint64_t earlier(uint64_t a, uint64_t b) { return a < b ? a : b; }

uint64_t next_of_simavr(const avr_t *avr) { return avr->cycle_timers.timer ? avr->cycle_timers.timer->when : NEVER; }

bool core_stopped(avr_board *b) {
  avr_t *avr = b->avr;
  if (avr->state == cpu_Sleeping) {
    b->sleeping = avr->data[REG_SMCR] & SLEEP_ENABLED;
    avr->state = cpu_Running;
  } else if (avr->state != cpu_Running) {
    if (!b->crashed) crash_at(b, NO_ADDRESS, "the program ran off the end of the flash");
    return false;
  }
  return true;
}

static void execute(avr_board *b, uint64_t until) {
  avr_t *avr = b->avr;
  uint64_t start = avr->cycle;
  bool alone = avr->interrupt_state < 0; /* one instruction, whatever is pending */
  if (alone) {
    avr->interrupt_state = 0;
    until = start + 1;
  }
  uint32_t address;
  if (b->recorder) {
    address = run_recorded(b, until);
  } else {
    address = b->debug ? run_debugged(b, until) : execute_instructions(b, until, NULL);
    core_stopped(b);
    b->counters.executed_cycles += avr->cycle - start;
  }
  check_jump(b, address);
}

board_state run_until(avr_board *b, uint64_t until) {
  avr_t *avr = b->avr;
  if (b->debug && !debug_looks(b)) return BOARD_STOPPED;
  while (avr->cycle < until) {
    catch_up(b, avr->cycle);
    if (b->reset_wanted) restart(b);
    if (board_takes_pause(&b->base)) return BOARD_PAUSED;
    if (b->held) {
      avr->cycle = earlier(until, b->next_due);
      continue;
    }
    if (b->crashed && b->debug && !debug_crashed(b)) return BOARD_STOPPED;
    if (b->crashed) return BOARD_CRASHED;
    if (next_of_simavr(avr) <= avr->cycle) avr_cycle_timer_process(avr);
    if (b->reset_wanted) continue;
    if (avr->sreg[S_I] && avr->interrupt_state >= 0 && enter_interrupt(b)) continue;
    if (b->debug && !debug_before(b)) return BOARD_STOPPED;
    uint64_t horizon = earlier(until, earlier(b->next_due, next_of_simavr(avr)));
    if (b->sleeping) {
      avr->cycle = horizon;
    } else {
      execute(b, horizon);
    }
  }
  catch_up(b, avr->cycle); /* from here on "now" is what `now` says */
  if (board_takes_pause(&b->base)) return BOARD_PAUSED;
  return b->crashed ? BOARD_CRASHED : BOARD_RUNNING;
}

void hear_core(avr_board *b) {
  avr_irq_register_notify(b->avr->irq + AVR_CORE_BAD_OPCODE, on_bad_opcode, b);
  avr_irq_register_notify(b->avr->interrupts.irq + AVR_INT_IRQ_RUNNING, on_reti, b);
}
