/* logs.c: see logs.h. */
#include "logs.h"

#include <stdlib.h>
#include <string.h>

void *buffer_room(buffer *self, size_t size) {
  if (self->start + self->count + size > self->capacity) {
    if (self->start > 0) memmove(self->data, self->data + self->start, self->count);
    self->start = 0;
    if (self->count + size > self->capacity) {
      const size_t capacity = 2 * self->capacity + size + 256;
      uint8_t *data = realloc(self->data, capacity);
      if (data == NULL) return NULL;
      self->data = data;
      self->capacity = capacity;
    }
  }
  return self->data + self->start + self->count;
}

void buffer_append(buffer *self, const void *bytes, size_t size) {
  void *room = buffer_room(self, size);
  if (room == NULL) return;
  memcpy(room, bytes, size);
  self->count += size;
}

size_t buffer_take(buffer *self, uint8_t *bytes, size_t capacity) {
  const size_t count = self->count < capacity ? self->count : capacity;
  if (count == 0) return 0;
  memcpy(bytes, self->data + self->start, count);
  self->count -= count;
  self->start = self->count == 0 ? 0 : self->start + count;
  return count;
}

void buffer_free(buffer *self) {
  free(self->data);
  *self = (buffer){0};
}

static int grow(edge_log *self) {
  const size_t capacity = self->capacity == 0 ? 4096 : 2 * self->capacity;
  board_edge *edges = realloc(self->edges, capacity * sizeof *edges);
  if (edges == NULL) return -1;
  self->edges = edges;
  self->capacity = capacity;
  return 0;
}

void edge_log_add(edge_log *self, uint64_t cycle, uint8_t pin, uint8_t level) {
  if (self->count >= self->capacity && self->capacity < SIM_EDGES_KEPT && grow(self) != 0) return;
  board_edge *edge = &self->edges[self->count++ & (self->capacity - 1)];
  edge->cycle = cycle;
  edge->pin = pin;
  edge->level = level;
}

size_t edge_log_copy(const edge_log *self, board_edge *out, size_t capacity) {
  const uint64_t kept = self->count < self->capacity ? self->count : self->capacity;
  const uint64_t count = kept < capacity ? kept : capacity;
  for (uint64_t i = 0; i < count; i++) out[i] = self->edges[(self->count - count + i) & (self->capacity - 1)];
  return (size_t)count;
}

void edge_log_free(edge_log *self) {
  free(self->edges);
  *self = (edge_log){0};
}
