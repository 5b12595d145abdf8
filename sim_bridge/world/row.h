/* row.h: worlds of one model that make their steps side by side.
 *
 * What all of them do stands in loops of ROW turns over arrays of numbers, one a world, and the compiler makes vectors of
 * it (lanes.h); the equations are the same inline functions that a world alone uses, so its bits are the same. What only
 * some of them do, as meeting a wall, each does alone.
 */
#ifndef WORLD_ROW_H
#define WORLD_ROW_H

#include "geometry/lanes.h"

#define ROW 8u /* two registers of AVX2 */

/* to[k] = value for each world k of a row. */
#define ROW_GATHER(to, k, value)                           \
  for (size_t group_ = 0; group_ < ROW; group_ += LANES) { \
    lanes all_;                                            \
    LANES_GATHER(all_, k, group_, value);                  \
    lanes_store(&(to)[group_], &all_);                     \
  }

#endif
