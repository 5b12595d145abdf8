/* core_machine.c: machine.h by this project's core, alone: nothing is joined to it. */
#include <stdlib.h>

#include "avr_core.h"
#include "machine.h"

static avr_core core;
static bool is_invalid;

static void cannot_go_on(avr_board *owner, unsigned opcode) {
  (void)owner, (void)opcode;
  is_invalid = true;
  avr_stop(&core);
}

void machine_create(void) {
  static const avr_owner_calls CALLS = {.cannot_go_on = cannot_go_on};
  if (!avr_core_create(&core)) abort();
  core.calls = &CALLS;
}

uint8_t *machine_data(void) { return core.data; }

void machine_write_flash(uint32_t address, uint16_t word) {
  core.flash[address] = (uint8_t)word;
  core.flash[address + 1] = (uint8_t)(word >> 8);
  avr_core_flash_changed(&core, address, 2);
}

void machine_set(const machine_state *state) {
  core.pc = state->pc;
  core.cycle = state->cycle;
  core.sleeping = false;
  avr_core_set_flags(&core, state->flags);
}

machine_state machine_get(void) {
  return (machine_state){.pc = core.pc, .cycle = core.cycle, .flags = avr_core_flags(&core)};
}

bool machine_run(uint64_t until) {
  is_invalid = false;
  do {
    const uint64_t before = core.cycle;
    avr_run(&core, until, NULL);
    is_invalid |= core.cycle == before; /* it is outside of the flash */
  } while (core.cycle < until && !is_invalid);
  return !is_invalid;
}

bool machine_go_round(void) {
  do {
    if (!machine_run(machine_get().cycle + 1)) return false;
  } while (machine_get().pc != 0);
  return true;
}
