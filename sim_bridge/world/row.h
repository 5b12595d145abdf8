/* row.h: worlds of one model that make their steps side by side.
 *
 * What all of them do is in loops of ROW turns over arrays of numbers, one a world, and the compiler makes vectors of
 * it; the equations are the same inline functions that a world alone uses, so its bits are the same. What only some of
 * them do, as meeting a wall, each does alone.
 */
#ifndef WORLD_ROW_H
#define WORLD_ROW_H

#define ROW 8u

#endif
