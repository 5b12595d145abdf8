/* unit.c: see unit.h. */
#include "unit.h"

#include "../noise.h"

#define UNITS UINT64_C(0x756e697473000000) /* their seed: no run has it by chance */

double unit_normal(uint64_t serial, uint32_t kind, uint32_t what) {
  return serial == 0 ? 0.0 : noise_normal(UNITS ^ serial, kind, what, 0);
}
