/* queue.h: arrays that grow behind and are taken from in front, as boards keep edges and bytes.
 * SPDX-License-Identifier: MIT
 */
#ifndef BOARDS_QUEUE_H
#define BOARDS_QUEUE_H

#include <stdlib.h>
#include <string.h>

/* The array with room for `count` more items of `size` bytes behind `*end`; those from `*first` on are kept. Memory may
 * not fail: a board that lost an edge or a byte would be wrong in silence. */
static inline void *board_room_for(void *items, size_t size, size_t *first, size_t *end, size_t *capacity,
                                   size_t count) {
  if (*end + count <= *capacity) return items;
  const size_t used = *end - *first, wanted = 2 * (used + count) + 64;
  if (used > 0) memmove(items, (char *)items + *first * size, used * size);
  *first = 0;
  *end = used;
  if (wanted <= *capacity) return items;
  *capacity = wanted;
  void *grown = realloc(items, wanted * size);
  if (grown == NULL) abort();
  return grown;
}

#endif
