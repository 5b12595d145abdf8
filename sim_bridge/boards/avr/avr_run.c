/* avr_run.c: run loop, interrupts and resets of the emulated ATmega328P.
 *
 * The loop keeps lockstep with the outside: it never waits for the host's clock, counts every cycle, and lets
 * instructions run exactly to the next event or to the end of the call. An instruction is never split: what is due
 * while it runs happens, at its own cycle, before the next one. Interrupts are taken between instructions: 4 cycles, 4
 * more from sleep (12.7), and one instruction always runs after SEI, RETI and a write that sets I.
 */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "avr_parts.h"
#include "core/avr_decode.h"

#define INTERRUPT_CYCLES 4u
#define WAKE_UP_CYCLES 4u
#define FRAME_WORDS 12u /* from IN to OUT where a function makes room for its variables */

enum { RESET_FLAG_POWER = 1, RESET_FLAG_EXTERNAL = 2, RESET_FLAG_BROWN_OUT = 4, RESET_FLAG_WATCHDOG = 8 }; /* MCUSR */

/* ---- what is due ---- */

void set_due(avr_board *b, due_source source, uint64_t cycle) {
  uint64_t before = b->due[source];
  b->due[source] = cycle;
  if (cycle <= b->core.next_due) {
    b->core.next_due = cycle;
    if (cycle < b->core.until) b->core.until = cycle;
  } else if (before == b->core.next_due) {
    b->core.next_due = NEVER;
    for (int i = 0; i < DUE_COUNT; i++) {
      if (b->due[i] < b->core.next_due) b->core.next_due = b->due[i];
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
    [DUE_FLASH] = flash_due,
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
  while (b->core.next_due <= cycle) {
    due_source source = DUE_DRIVEN_EDGE;
    while (b->due[source] != b->core.next_due) source++;
    if (b->core.next_due > b->core.clock) b->core.clock = b->core.next_due;
    happen(b, source, b->core.clock);
  }
  if (cycle > b->core.clock) b->core.clock = cycle;
}

/* ---- flags of interrupts ---- */

void interrupts_changed(avr_board *b) {
  if ((b->core.raised & b->core.enabled) && b->core.flags.i) avr_stop(&b->core);
}

void raise_flag(avr_board *b, uint8_t vector) {
  b->core.raised |= FLAG(vector);
  if (b->recorder) spans_requested(b, vector, b->core.clock);
  interrupts_changed(b);
}

void clear_flag(avr_board *b, uint8_t vector) {
  b->core.raised &= ~FLAG(vector);
  if (b->recorder) spans_request_gone(b, vector);
}

void enable_interrupt(avr_board *b, uint8_t vector, bool enabled) {
  uint32_t before = b->core.enabled;
  b->core.enabled = enabled ? b->core.enabled | FLAG(vector) : b->core.enabled & ~FLAG(vector);
  if (b->recorder && b->core.enabled != before)
    spans_requested(b, vector, b->core.clock + 1); /* from the write's end on */
  interrupts_changed(b);
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
    snprintf(b->fault + used, room, " in cycle %llu", (unsigned long long)b->core.cycle);
  } else {
    snprintf(b->fault + used, room, " at address 0x%04X in cycle %llu", (unsigned)address,
             (unsigned long long)b->core.cycle);
  }
  b->fault_address = address;
  b->crashed = true;
}

void check_stack(avr_board *b, uint32_t address, bool set) {
  uint32_t pointer = avr_stack(&b->core), lowest = b->core.stack_floor;
  if (set && pointer + 1u >= AVR_RAM_BEGIN && pointer + 1u < lowest) {
    note(b, address, "has a stack among", "its variables", "legal, but what it overwrites there is not seen");
    b->core.stack_floor = AVR_RAM_BEGIN;
  } else if (pointer + 1u < lowest) {
    crash_at(b, address, "the stack overflows: it reaches 0x%04X, variables end below 0x%04X", (unsigned)pointer + 1u,
             (unsigned)lowest);
  } else if (pointer >= BOARD_DATA_SIZE) {
    crash_at(b, address, "the stack pointer leaves the memory: 0x%04X", (unsigned)pointer);
  }
}

/* Whether OUT SPL at `at` makes the stack grow, as the functions of gcc do for their variables (IN Rd, SPL; a
 * subtraction; OUT SPL, Rd), and does not choose another one, whose pointer is loaded. */
static bool grows_stack(const avr_core *core, uint32_t at) {
  const uint8_t source = core->code[at / 2u].d;
  for (uint32_t words = 1; words <= FRAME_WORDS && 2 * words <= at; words++) {
    const avr_instruction *i = &core->code[at / 2u - words];
    const bool reads_stack = i->kind == IN && (i->k == REG_SPL || i->k == REG_SPH);
    const bool loads = i->kind == LDI || i->kind == LDD || i->kind == LD_UP || i->kind == LD_DOWN || i->kind == LDS ||
                       i->kind == LDS_RAM || i->kind == POP;
    if ((loads || reads_stack) && i->d == source) return reads_stack;
  }
  return false;
}

/* A stack pointer that is not where it may be has gone wrong only behind an instruction that leaves it whole: a program
 * writes it in two halves, the upper one first (avr-libc, gcc), and what is between them says nothing. */
static void left_stack(avr_board *b, uint32_t at, uint16_t before) {
  avr_core *core = &b->core;
  const uint32_t pointer = avr_stack(core);
  const bool sets = core->code[at / 2u].kind == OUT_SPL;
  if (pointer + 1u < core->stack_floor || pointer >= AVR_DATA_SIZE) {
    check_stack(b, at, sets ? !grows_stack(core, at) : before + 1u < core->stack_floor);
    if (b->crashed) avr_stop(core);
  } else if (sets && pointer + 1u >= b->variables_end) {
    core->stack_floor = b->variables_end; /* it was elsewhere */
  }
}

/* The board stops if the instruction at `address`, or an interrupt behind it, has led to where none is. */
static void check_jump(avr_board *b, uint32_t address) {
  const avr_core *core = &b->core;
  if (b->crashed || avr_is_code(core, core->pc)) return;
  if (address >= AVR_FLASH_SIZE) {
    crash_at(b, NO_ADDRESS, "the program ran off the end of the flash");
    return;
  }
  if (address >= core->code_end) address = core->code_end - 2u; /* it ran straight on, behind the last instruction */
  const uint8_t kind = core->code[address / 2u].kind;
  if (b->programming.blocked && core->pc < AVR_NRWW_BEGIN) {
    crash_at(b, address, "the program goes to 0x%04X while flash is written there (RWWSB is set, 27.8.6)",
             (unsigned)core->pc);
  } else if (core->pc == 0 && kind != RET && kind != RETI) {
    note(b, address, "jumps to", "its start",
         "no reset, registers keep their values (a null pointer? an interrupt without a handler?)");
  } else if (core->pc == 0) {
    crash_at(b, address, "the program returns to its start without a reset");
  } else {
    crash_at(b, address, "the program goes to 0x%04X, but ends at 0x%04X", (unsigned)core->pc,
             (unsigned)core->code_end);
  }
}

static void runs_erased(avr_board *b) {
  note(b, b->core.pc, "runs through", "erased flash", "no program is there: it goes on to what follows");
}

static void cannot_go_on(avr_board *b, unsigned opcode) {
  crash_at(b, b->core.pc, "the program reached the invalid instruction 0x%04X", opcode);
}

static void beyond_memory(avr_board *b) {
  note(b, b->core.pc, "reads or writes", "behind the memory's end", "nothing is there; here it is RAM again");
}

/* ---- an interrupt begins ---- */

/* What the hardware does to the flag when the interrupt is executed. */
static void acknowledge(avr_board *b, uint8_t vector) {
  timer_state *timer = timer_of_vector(b, vector);
  if (timer) timer_bring_up(timer, b->core.cycle);
  bool is_state =
      vector == VECTOR_USART_RX || vector == VECTOR_USART_UDRE || vector == VECTOR_EE_READY || vector >= VECTOR_TWI;
  if (!is_state) clear_flag(b, vector);
  if (timer) timer_plan(timer);
  if (vector == VECTOR_WDT) watchdog_acknowledged(b);
  if (vector == VECTOR_INT0 || vector == VECTOR_INT1) pins_acknowledged(b, vector);
}

/* Executes the most urgent pending interrupt, if there is one. */
static bool enter_interrupt(avr_board *b) {
  avr_core *core = &b->core;
  const uint32_t pending = core->raised & core->enabled;
  if (!pending) return false;
  const uint8_t vector = (uint8_t)__builtin_ctz(pending);
  if (b->recorder) spans_accept(b, vector, core->cycle + (core->sleeping ? WAKE_UP_CYCLES : 0));
  acknowledge(b, vector);
  const uint32_t interrupted = core->pc;
  const bool elsewhere = avr_stack(core) + 1u < core->stack_floor;
  avr_enter_interrupt(core, vector);
  check_stack(b, interrupted, elsewhere);
  check_jump(b, interrupted);
  core->cycle += INTERRUPT_CYCLES + (core->sleeping ? WAKE_UP_CYCLES : 0);
  if (core->sleeping) {
    core->sleeping = false;
    if (b->recorder) spans_woke(b);
  }
  b->counters.executed_cycles += INTERRUPT_CYCLES;
  b->counters.interrupts++;
  return true;
}

/* ---- reset ---- */

void want_reset(avr_board *b, board_reset_cause cause) {
  b->reset_wanted |= (uint8_t)(1u << cause);
  avr_stop(&b->core);
}

/* What is in RAM and registers when the power comes is anything: here another anything at each power-on of a run, the
 * same in each run. */
static void scramble_memory(avr_board *b) {
  uint32_t x = 0x328u + (uint32_t)b->counters.resets * 0x9E3779B9u;
  for (size_t i = 0; i < BOARD_DATA_SIZE; i++) {
    x = x * 1664525u + 1013904223u;
    b->core.data[i] = (uint8_t)(x >> 24);
  }
}

void halt_cpu(avr_board *b, unsigned cycles) {
  b->core.cycle += cycles;
  avr_stop(&b->core);
}

void restart(avr_board *b) {
  const uint64_t cycle = b->core.cycle;
  uint8_t causes = b->reset_wanted;
  uint8_t flags = b->core.data[REG_MCUSR];
  if (causes & (1u << BOARD_RESET_EXTERNAL)) flags |= RESET_FLAG_EXTERNAL;
  if (causes & (1u << BOARD_RESET_BROWN_OUT)) flags |= RESET_FLAG_BROWN_OUT;
  if (causes & (1u << BOARD_RESET_WATCHDOG)) flags |= RESET_FLAG_WATCHDOG;
  if (causes & (1u << BOARD_RESET_POWER)) {
    flags = RESET_FLAG_POWER;
    scramble_memory(b);
    if (b->core.written) memset(b->core.written, 0, BOARD_DATA_SIZE);
  }
  b->reset_wanted = 0;
  b->counters.resets++;
  b->crashed = false;
  b->core.stack_floor = b->variables_end;
  avr_core_reset(&b->core, b->reset_address);
  b->core.data[REG_MCUSR] = flags;
  if (b->recorder) spans_restart(b);
  b->timer_base[0] = b->timer_base[1] = cycle;
  timers_reset(b, cycle);
  usart_reset(b);
  twi_reset(b);
  spi_reset(b);
  converter_reset(b);
  watchdog_reset(b, cycle);
  eeprom_reset(b, causes & (1u << BOARD_RESET_POWER | 1u << BOARD_RESET_BROWN_OUT));
  flash_reset(b);
  pins_reset(b, cycle);
}

/* ---- run loop ---- */

static uint64_t earlier(uint64_t a, uint64_t b) { return a < b ? a : b; }

static void execute(avr_board *b, uint64_t until) {
  avr_core *core = &b->core;
  const uint64_t start = core->cycle;
  if (core->one_more) until = start + 1; /* one instruction, whatever is pending */
  core->one_more = false;
  uint32_t address;
  if (b->recorder) {
    address = run_recorded(b, until);
  } else {
    address = b->debug ? run_debugged(b, until) : avr_run(core, until, NULL);
    b->counters.executed_cycles += core->cycle - start;
  }
  if (avr_looks_where_it_goes(core->code[address / 2u].kind)) check_jump(b, address);
}

board_state run_until(avr_board *b, uint64_t until) {
  avr_core *core = &b->core;
  if (b->debug && !debug_looks(b)) return BOARD_STOPPED;
  while (core->cycle < until) {
    catch_up(b, core->cycle);
    if (b->reset_wanted) restart(b);
    if (board_takes_pause(&b->base)) return BOARD_PAUSED;
    if (b->held) {
      core->cycle = earlier(until, core->next_due);
      continue;
    }
    if (b->crashed && b->debug && !debug_crashed(b)) return BOARD_STOPPED;
    if (b->crashed) return BOARD_CRASHED;
    if (core->flags.i && !core->one_more && enter_interrupt(b)) continue;
    if (b->debug && !debug_before(b)) return BOARD_STOPPED;
    const uint64_t horizon = b->no_fast_forward ? core->cycle + 1 : earlier(until, core->next_due);
    if (core->sleeping) {
      core->cycle = horizon;
    } else {
      execute(b, horizon);
    }
  }
  catch_up(b, core->cycle); /* from here on "now" is what `now` says */
  if (board_takes_pause(&b->base)) return BOARD_PAUSED;
  return b->crashed ? BOARD_CRASHED : BOARD_RUNNING;
}

const avr_owner_calls CALLS_OF_CORE = {
    .happen = catch_up,
    .watchdog_reset = watchdog_kick,
    .store_program = flash_store,
    .load_program = flash_load,
    .left_stack = left_stack,
    .never_written = check_never_written,
    .beyond_memory = beyond_memory,
    .runs_erased = runs_erased,
    .cannot_go_on = cannot_go_on,
};
