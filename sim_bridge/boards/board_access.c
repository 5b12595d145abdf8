/* board_access.c: see board_access.h.
 * SPDX-License-Identifier: MIT
 */
#include "board_access.h"

#include <stdlib.h>

#include "queue.h"

static void sink(void *context, uint64_t cycle, uint8_t pin, uint8_t level) {
  board_access *self = context;
  board_log *log = &self->log;
  log->edges = board_room_for(log->edges, sizeof *log->edges, &log->first, &log->end, &log->capacity, 1);
  log->edges[log->end++] = (board_edge){.cycle = cycle, .pin = pin, .level = level};
}

static double volts(void *context, uint64_t cycle, uint8_t channel) {
  const board_access *self = context;
  if (channel == BOARD_ANALOG_SUPPLY) return self->supply;
  return channel < 6 ? self->volts[channel] : 0.0;
}

board_access *board_access_open(board *target) {
  if (!target || target->op->version != BOARD_INTERFACE_VERSION) return NULL;
  board_access *self = calloc(1, sizeof *self);
  if (!self) return NULL;
  self->board = target;
  target->sink = sink;
  target->sink_context = self;
  target->op->analog(target, volts, self);
  return self;
}

void board_access_close(board_access *self) {
  if (!self) return;
  self->board->sink = NULL;
  self->board->op->analog(self->board, NULL, NULL);
  free(self->log.edges);
  free(self);
}

void board_access_drive_wave(board_access *self, uint64_t first, uint64_t half, size_t count, uint8_t pin,
                             uint8_t level) {
  for (size_t i = 0; i < count; i++) {
    self->board->op->drive(self->board, first + i * half, pin, i % 2 ? !level : level);
  }
}
