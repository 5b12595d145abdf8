/* own_chips.h: chips on the two-wire bus whose bytes a callback supplies (a test's Python class), from inside the board's
 * run. One part for all such chips at two pins: it is asked for each address.
 */
#ifndef PART_OWN_CHIPS_H
#define PART_OWN_CHIPS_H

#include "two_wire.h"

/* python: begin */
enum { OWN_CHIP_BEGIN, OWN_CHIP_WRITE, OWN_CHIP_READ };

/* OWN_CHIP_BEGIN: `byte` is an address and the bit R/W: returns 1 if a chip has it. OWN_CHIP_WRITE: the chip that was
 * addressed gets `byte`: 1 to acknowledge it. OWN_CHIP_READ: returns the byte that it sends. */
typedef int own_chips_answer(void *context, int does, uint8_t byte, uint64_t cycle);

typedef struct {
  own_chips_answer *answer;
  void *context;
} own_chips_parameters;

/* Parameters: own_chips_parameters. Pins: SDA, SCL. */
extern const part_kind own_chips_kind;
/* python: end */

#endif
