/* supply.c: see supply.h. The converter measures the bandgap with the supply as its reference, so that
 *   result = bandgap * 1024 / supply     (24.7)     and     supply = bandgap * 1024 / result.
 * A step of the result is 22 mV at 5 V. */
#include "supply.h"

#include "analog.h"
#include "bounds.h"
#include "hal/hal.h"
#include "link/parameters.h"

#define HYSTERESIS 100u /* mV */
#define RESULT_MIN 32u  /* 35 V: no result of a chip that works */

static uint16_t voltage;
static bool low;
static bool was_below;   /* the last measurement was */
static bool has_settled; /* a measurement since power was given to bandgap and converter is past */

void supply_start(void) {
  HAL_ZERO(voltage);
  HAL_ZERO(low);
  HAL_ZERO(was_below);
  HAL_ZERO(has_settled);
}

/* bandgap * 1024 / result, rounded down: a division of 16 bits and five steps of a longer one by hand. One of 32 bits
 * would take more time than the task has. */
static uint16_t millivolts(uint16_t bandgap, uint16_t result) {
  const uint16_t dividend = (uint16_t)(bandgap * 32u); /* at most 38400 */
  uint16_t quotient = dividend / result;
  uint16_t rest = dividend % result;
  BOUNDED(5, for (uint8_t step = 0; step < 5u; step++)) {
    quotient = (uint16_t)(quotient << 1);
    rest = (uint16_t)(rest << 1);
    if (rest >= result) {
      rest = (uint16_t)(rest - result);
      quotient++;
    }
  }
  return quotient;
}

/* A minimum of 0 is never undercut. */
static void judge(uint16_t minimum) {
  const bool below = voltage < minimum;
  if (voltage > minimum + HYSTERESIS) {
    low = false;
  } else if (below && was_below) {
    low = true;
  }
  was_below = below;
}

void supply_task(void) {
  const uint16_t result = analog_take_bandgap();
  if (result < RESULT_MIN) {
    return;
  }
  if (!has_settled) { /* the first conversion after the reference was chosen may be wrong (24.5.2) */
    has_settled = true;
    return;
  }
  voltage = millivolts(parameters_u16(PARAMETER_BANDGAP), result);
  judge(parameters_u16(PARAMETER_SUPPLY_MINIMUM));
}

uint16_t supply_voltage(void) { return voltage; }

bool supply_low(void) { return low; }
