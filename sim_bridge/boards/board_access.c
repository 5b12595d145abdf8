/* board_access.c: see board_access.h.
 * SPDX-License-Identifier: MIT
 */
#include "board_access.h"

#include <stdlib.h>

void board_log_add(void *log, uint64_t cycle, uint8_t pin, uint8_t level) {
  board_log *self = log;
  if (self->count == self->capacity) {
    size_t capacity = self->capacity ? 2 * self->capacity : 1024;
    board_edge *edges = realloc(self->edges, capacity * sizeof *edges);
    if (!edges) abort(); /* a log with a gap would lie */
    self->edges = edges;
    self->capacity = capacity;
  }
  self->edges[self->count++] = (board_edge){cycle, pin, level};
}

void board_log_clear(board_log *log) { log->count = 0; }

void board_log_free(board_log *log) {
  free(log->edges);
  *log = (board_log){0};
}

static void sink(void *context, uint64_t cycle, uint8_t pin, uint8_t level) {
  board_access *self = context;
  board_log_add(&self->log, cycle, pin, level);
  if (pin == self->echo_pin && level <= BOARD_RELEASED) {
    self->board->op->drive(self->board, cycle + self->echo_delay, (uint8_t)self->echo_to, level);
  }
}

static double volts(void *context, uint64_t cycle, uint8_t channel) {
  const board_access *self = context;
  (void)cycle;
  if (channel == BOARD_ANALOG_SUPPLY) return self->supply;
  return channel < 6 ? self->volts[channel] : 0.0;
}

board_access *board_access_open(board *target) {
  if (!target || target->op->version != BOARD_INTERFACE_VERSION) return NULL;
  board_access *self = calloc(1, sizeof *self);
  if (!self) return NULL;
  self->board = target;
  self->echo_pin = -1;
  target->sink = sink;
  target->sink_context = self;
  target->op->analog(target, volts, self);
  return self;
}

void board_access_close(board_access *self) {
  if (!self) return;
  self->board->sink = NULL;
  self->board->op->analog(self->board, NULL, NULL);
  board_log_free(&self->log);
  free(self);
}

uint64_t board_access_now(const board_access *self) { return self->board->op->now(self->board); }

int board_access_advance(board_access *self, uint64_t until) {
  return (int)self->board->op->advance(self->board, until);
}

void board_access_drive(board_access *self, uint64_t at, uint8_t pin, uint8_t level) {
  self->board->op->drive(self->board, at, pin, level);
}

void board_access_drive_wave(board_access *self, uint64_t first, uint64_t half, size_t count, uint8_t pin,
                             uint8_t level) {
  for (size_t i = 0; i < count; i++) {
    self->board->op->drive(self->board, first + i * half, pin, i % 2 ? !level : level);
  }
}

void board_access_send(board_access *self, uint64_t at, const uint8_t *bytes, size_t count) {
  self->board->op->send(self->board, at, bytes, count);
}

size_t board_access_receive(board_access *self, uint8_t *bytes, uint64_t *cycles, size_t capacity) {
  return self->board->op->receive(self->board, bytes, cycles, capacity);
}

void board_access_line_rate(board_access *self, uint32_t baud) { self->board->op->line_rate(self->board, baud); }

void board_access_reset(board_access *self, int cause) {
  self->board->op->reset(self->board, (board_reset_cause)cause);
}

/* ---- of any board -------------------------------------------------------------------------------------------------- */

void board_free(board *self) { self->op->destroy(self); }

uint8_t board_output(const board *self, uint8_t pin) {
  return pin < BOARD_PIN_COUNT ? self->op->output(self, pin) : (uint8_t)BOARD_RELEASED;
}

void board_count(const board *self, board_counters *out) { self->op->counters(self, out); }

const char *board_fault(const board *self) { return self->op->fault(self); }

int64_t board_fault_address(board *self) {
  const uint32_t *found = self->op->extension(self, BOARD_FAULT_ADDRESS);
  return found ? (int64_t)*found : -1;
}

uint8_t *board_memory(board *self) { return self->op->extension(self, BOARD_DATA); }

board_eeprom *board_eeprom_of(board *self) { return self->op->extension(self, BOARD_EEPROM); }

const board_watchdog_log *board_watchdog_log_of(board *self) { return self->op->extension(self, BOARD_WATCHDOG_LOG); }

const board_notes *board_notes_of(board *self) { return self->op->extension(self, BOARD_NOTES); }
