/* parameters.c: see parameters.h. */
#include "link/parameters.h"

#include "generated/messages.h"
#include "hal/hal.h"
#include "pins.h"

typedef struct {
  int32_t minimum, maximum, initial;
} parameter_range;

#define RANGE(name, id, minimum, maximum, initial) [id] = {(minimum), (maximum), (initial)},
HAL_TABLE parameter_range ranges[PARAMETER_COUNT] = {PARAMETER_LIST(RANGE)};
#undef RANGE

#define WITHIN(name, id, minimum, maximum, initial) \
  _Static_assert((initial) >= (minimum) && (initial) <= (maximum), "default of " #name);
PARAMETER_LIST(WITHIN)
#undef WITHIN
_Static_assert((DEFAULT_DEVICES & ~PARAMETERS_DEVICES_BUILT) == 0, "the robot switches on a device that is not built");

static int32_t values[PARAMETER_COUNT];

static parameter_range range_of(uint8_t parameter) {
  parameter_range range;
  hal_table_copy(&range, &ranges[parameter], sizeof range);
  return range;
}

void parameters_start(void) {
  for (uint8_t parameter = 0; parameter < PARAMETER_COUNT; parameter++) {
    values[parameter] = range_of(parameter).initial;
  }
}

int32_t parameters_get(uint8_t parameter) { return parameter < PARAMETER_COUNT ? values[parameter] : 0; }

uint8_t parameters_set(uint8_t parameter, int32_t value) {
  if (parameter >= PARAMETER_COUNT) {
    return PARAMETER_STATUS_UNKNOWN_PARAMETER;
  }
  const parameter_range range = range_of(parameter);
  if (value < range.minimum || value > range.maximum ||
      (parameter == PARAMETER_DEVICES && (value & ~(int32_t)PARAMETERS_DEVICES_BUILT) != 0)) {
    return PARAMETER_STATUS_OUT_OF_RANGE;
  }
  values[parameter] = value;
  return PARAMETER_STATUS_OK;
}

bool parameters_device_on(uint16_t device) { return ((uint16_t)values[PARAMETER_DEVICES] & device) != 0; }
