/* logs.h: what a run leaves behind: growing arrays of bytes, and the board's newest output edges.
 *
 * Nothing here fails in the middle of a step: what finds no memory is left out.
 */
#ifndef PARTS_LOGS_H
#define PARTS_LOGS_H

#include <stddef.h>
#include <stdint.h>

#include "../boards/board.h"

/* python: begin */
/* The clock of a moving shape's path runs at another rate from `time` on: slower than the world's while it waits. Between
 * two rows of a shape, and from the last one to now, `waited` goes evenly. */
typedef struct {
  double time;   /* s */
  double shape;  /* its number among the arena's moving shapes */
  double waited; /* s by which it is behind then */
} sim_wait;

/* A moving shape was put elsewhere: from `time` on it goes along its way shifted by so much. */
typedef struct {
  double time;          /* s */
  double shape;         /* its number among the arena's moving shapes */
  double x, y, heading; /* m, m, rad */
} sim_shift;

/* A growing array of bytes; what is in it is `count` bytes from `start` on. */
typedef struct {
  uint8_t *data;
  size_t start, count, capacity;
} buffer;

/* Takes at most `capacity` bytes from the front. Returns how many. */
size_t buffer_take(buffer *self, uint8_t *bytes, size_t capacity);

/* The newest SIM_EDGES_KEPT edges: a ring once it is full. */
typedef struct {
  board_edge *edges;
  size_t capacity; /* a power of two, or 0 */
  uint64_t count;  /* edges seen */
} edge_log;

/* Copies the newest, at most `capacity`, oldest first. Returns how many. */
size_t edge_log_copy(const edge_log *self, board_edge *out, size_t capacity);
/* python: end */

#define SIM_EDGES_KEPT (1u << 20)

/* Room for `size` more bytes behind what is there, or NULL. */
void *buffer_room(buffer *self, size_t size);

void buffer_append(buffer *self, const void *bytes, size_t size);

void buffer_free(buffer *self);

void edge_log_add(edge_log *self, uint64_t cycle, uint8_t pin, uint8_t level);

void edge_log_free(edge_log *self);

#endif
