/* fault.h: what is wrong with a part from one cycle to another, by name, laid on it from outside.
 *
 * A part asks for its faults where they act, in its own file; without any that costs one compare. A fault has fired where
 * what went out was not what would have gone out without it. Draws depend on (seed, robot, part, kind, cycle) only, also when
 * noise is off: the part's own sequence of draws is what it is without the fault.
 *
 * Some faults hold a pin at a level. What the part does there meanwhile goes out when the fault ends.
 */
#ifndef PART_FAULT_H
#define PART_FAULT_H

#include <stddef.h>
#include <stdint.h>

#include "../world/noise.h"

/* python: begin */
enum {
  FAULT_STUCK,
  FAULT_BOUNCING,
  FAULT_BLINDED,
  FAULT_MISSING,
  FAULT_LATE,
  FAULT_DOUBLED,
  FAULT_EXTRA,
  FAULT_NOISY,
  FAULT_DEAD,
  FAULT_WEAK,
  FAULT_OFFSET,
  FAULT_REVERSED,
  FAULT_DIRTY,
  FAULT_SAGGING,
  FAULT_BLOCKED,
  FAULT_SLIPPING,
  FAULT_LIFTED
};
/* python: end */

#define FAULT_NEVER UINT64_MAX
#define FAULT_NOISE 10000u /* the keys of kind k are higher by this times k + 1 than those of parts */

typedef struct fault fault;
struct fault {
  fault *next; /* of the same part, by their begins */
  int kind;
  double value;        /* in the unit that the device's FAULTS have */
  uint64_t begin, end; /* cycles; it does not act at `end`, which may be FAULT_NEVER */
  uint64_t key;        /* of its draws */
  uint64_t fired;
  uint8_t pin, level; /* that it holds; pin PART_NO_PIN: none */
  uint8_t before;     /* what the part does to that pin when it begins */
};

/* The fault of that kind in a list that acts at `cycle`, or NULL. */
fault *fault_find(fault *first, int kind, uint64_t cycle);

/* Puts one into a list. Returns 0, or -1: one of its kind acts at the same time. */
int fault_insert(fault **first, fault *made);

/* Where its draws for what happens at `cycle` come from. */
static inline noise_source fault_noise(const fault *self, uint64_t cycle) {
  return (noise_source){.key = hash_mix(self->key ^ cycle), .keyed = 1, .on = 1};
}

#endif
