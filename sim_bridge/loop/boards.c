/* boards.c: see loop.h. Here: operations of a board by its address, for Python. */
#include <string.h>

#include "loop.h"

int board_check(uintptr_t address) {
  const board *b = (const board *)address;
  return b != NULL && b->op != NULL && b->op->version == BOARD_INTERFACE_VERSION ? SIM_OK : SIM_WRONG_BOARD;
}

uint8_t board_output(uintptr_t address, uint8_t pin) {
  const board *b = (const board *)address;
  return pin < BOARD_PIN_COUNT ? b->op->output(b, pin) : (uint8_t)BOARD_RELEASED;
}

void board_destroy(uintptr_t address) {
  board *b = (board *)address;
  b->op->destroy(b);
}

const char *board_fault(uintptr_t address) {
  const board *b = (const board *)address;
  return b->op->fault(b);
}

int64_t board_fault_address(uintptr_t address) {
  board *b = (board *)address;
  const uint32_t *found = b->op->extension(b, BOARD_FAULT_ADDRESS);
  return found ? (int64_t)*found : -1;
}

void board_read_counters(uintptr_t address, uint64_t counters[8]) {
  const board *b = (const board *)address;
  board_counters c = {0};
  b->op->counters(b, &c);
  const uint64_t values[8] = {c.executed_cycles, c.interrupts,     c.bytes_in, c.bytes_out,
                              c.overruns,        c.framing_errors, c.resets,   c.edges_out};
  memcpy(counters, values, sizeof values);
}
