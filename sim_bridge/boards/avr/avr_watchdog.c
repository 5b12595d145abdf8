/* avr_watchdog.c: the watchdog timer (11.8): 2048 << WDP cycles of its own 128 kHz oscillator, taken to be exact. In the
 * interrupt and system reset mode (WDE and WDIE) the first time-out asks for the interrupt, whose execution clears WDIE;
 * the next one resets, whether the interrupt was executed or not (table 11-1). Of each reset it keeps where the program was:
 * when the interrupt was executed, or else at the reset.
 */
#include <stdlib.h>

#include "avr_parts.h"

#define OSCILLATOR_HZ 128000u
#define CHANGE_CYCLES 4u /* how long WDCE stays set */

enum { WDIF = 0x80, WDIE = 0x40, WDP3 = 0x20, WDCE = 0x10, WDE = 0x08, WDP_LOW = 0x07, WDRF = 0x08 };

static uint64_t period(const avr_board *b) {
  uint8_t control = b->core.data[REG_WDTCSR];
  unsigned step = (control & WDP_LOW) | (control & WDP3 ? 8u : 0u);
  if (step > 9) step = 9; /* reserved */
  return (UINT64_C(2048) << step) * (BOARD_CLOCK_HZ / OSCILLATOR_HZ);
}

static void plan(avr_board *b) {
  bool runs = b->core.data[REG_WDTCSR] & (WDE | WDIE);
  set_due(b, DUE_WATCHDOG, runs ? b->watchdog.since + period(b) : NEVER);
}

static void note_reset(avr_board *b, uint64_t cycle) {
  board_watchdog_log *log = &b->watchdog_log;
  log->resets = board_room_for(log->resets, sizeof *log->resets, &log->first, &log->end, &log->capacity, 1);
  bool warned = b->watchdog.warned_at != NO_ADDRESS;
  log->resets[log->end++] = (board_watchdog_reset){
      .cycle = warned ? b->watchdog.warned_cycle : cycle,
      .address = warned ? b->watchdog.warned_at : b->core.pc,
  };
}

void watchdog_due(avr_board *b, uint64_t cycle) {
  const uint8_t *control = &b->core.data[REG_WDTCSR];
  b->watchdog.since = cycle;
  bool warned = (*control & WDE) && (b->core.raised & FLAG(VECTOR_WDT));
  if ((*control & WDIE) && !warned) {
    b->watchdog.warned_at = NO_ADDRESS; /* not yet, this time */
    raise_flag(b, VECTOR_WDT);
  } else {
    note_reset(b, cycle);
    want_reset(b, BOARD_RESET_WATCHDOG);
  }
  plan(b);
}

/* Interrupt and reset mode: the interrupt was the warning. */
void watchdog_acknowledged(avr_board *b) {
  uint8_t *control = &b->core.data[REG_WDTCSR];
  b->watchdog.warned_at = b->core.pc;
  b->watchdog.warned_cycle = b->core.cycle;
  if (!(*control & WDE)) return;
  *control &= (uint8_t)~WDIE;
  enable_interrupt(b, VECTOR_WDT, false);
}

/* With interrupts on it is not the warning's interrupt that kicks: the program has come to itself. */
void watchdog_kick(avr_board *b) {
  if (b->core.flags.i) b->watchdog.warned_at = NO_ADDRESS;
  b->watchdog.since = b->core.cycle + 1;
  if (b->due[DUE_WATCHDOG] != NEVER) plan(b);
}

static uint8_t read_control(avr_board *b, uint16_t address, uint64_t cycle) {
  uint8_t value = b->core.data[address] & (WDIE | WDP3 | WDE | WDP_LOW);
  if (cycle < b->watchdog.change_until) value |= WDCE;
  if (b->core.raised & FLAG(VECTOR_WDT)) value |= WDIF;
  return value;
}

static void write_control(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  bool may_change = end <= b->watchdog.change_until;
  uint8_t old = b->core.data[address];
  uint8_t control = old & (WDP3 | WDP_LOW | WDE);
  if (may_change && !(value & WDCE)) { /* the second write of the timed sequence */
    control = value & (WDP3 | WDP_LOW | WDE);
    b->watchdog.change_until = 0;
  } else if ((value & WDCE) && (value & WDE)) {
    b->watchdog.change_until = end + CHANGE_CYCLES;
  }
  control |= value & WDE; /* can always be set */
  if (b->core.data[REG_MCUSR] & WDRF) control |= WDE;
  if (!(value & WDCE) && ((value ^ control) & (WDP3 | WDP_LOW | WDE))) {
    note(b, b->core.pc, "writes to", "WDTCSR", "it is dropped: WDRF is set, or WDCE was not just before (11.9.2)");
  }
  control |= value & WDIE;
  b->core.data[address] = control;
  if (!(old & (WDE | WDIE))) b->watchdog.since = end;
  if (value & WDIF) clear_flag(b, VECTOR_WDT);
  enable_interrupt(b, VECTOR_WDT, control & WDIE);
  plan(b);
}

void watchdog_reset(avr_board *b, uint64_t cycle) {
  b->watchdog = (watchdog_state){.since = cycle, .warned_at = NO_ADDRESS};
  b->core.data[REG_WDTCSR] = b->core.data[REG_MCUSR] & WDRF ? WDE : 0;
  plan(b);
}

void watchdog_free(avr_board *b) { free(b->watchdog_log.resets); }

void watchdog_init(avr_board *b) {
  on_read(b, REG_WDTCSR, read_control);
  on_write(b, REG_WDTCSR, write_control);
}
