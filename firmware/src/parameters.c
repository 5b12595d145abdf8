/* parameters.c: see parameters.h. Ranges and defaults are in flash, the values in 16 bits each. */
#include "parameters.h"

#include <string.h>

#include "generated/values.h"
#include "hal/hal.h"

typedef struct {
  uint16_t
      minimum;   /* as the values are kept; of an i16 it is negative, of a u16 below 32768: so the two types differ */
  uint16_t span; /* from minimum to maximum */
} parameter_range;

#define RANGE(name, type, minimum, maximum, initial) \
  [PARAMETER_##name] = {(uint16_t)(minimum), (uint16_t)((maximum) - (minimum))},
HAL_TABLE parameter_range ranges[PARAMETER_COUNT] = {PARAMETER_LIST(RANGE)};
#undef RANGE

#define INITIAL(name, type, minimum, maximum, initial) [PARAMETER_##name] = (uint16_t)(initial),
HAL_TABLE uint16_t initials[PARAMETER_COUNT] = {PARAMETER_LIST(INITIAL)};
#undef INITIAL

/* Rates that the line can have, in counts of the parameter. */
HAL_TABLE uint16_t baud_rates[] = {96, 192, 384, 576, 1152, 2500, 5000, 10000};
#define BAUD_RATES (sizeof baud_rates / sizeof *baud_rates)

static uint16_t values[PARAMETER_COUNT];
static bool has_host_come; /* since the start */

static __attribute__((noinline)) parameter_range range_of(uint8_t parameter) {
  return (parameter_range){hal_table_word(&ranges[parameter].minimum), hal_table_word(&ranges[parameter].span)};
}

/* The number that is stored in 16 bits. */
static int32_t decoded(uint16_t kept, parameter_range range) {
  return (int16_t)range.minimum < 0 ? (int32_t)(int16_t)kept : (int32_t)kept;
}

static bool is_baud_rate(uint16_t value) {
  for (uint8_t i = 0; i < BAUD_RATES; i++) {
    if (value == hal_table_word(&baud_rates[i])) {
      return true;
    }
  }
  return false;
}

/* Modulo 65536, only an allowed value is within the span, counted from the minimum. */
static bool is_allowed(uint8_t parameter, uint16_t kept, parameter_range range) {
  if ((uint16_t)(kept - range.minimum) > range.span) {
    return false;
  }
  switch (parameter) {
#define ARE_BUILT(name, first) \
  case PARAMETER_##name:       \
    return (kept & (uint16_t) ~(DEVICES_BUILT >> (first))) == 0;
    DEVICES_LIST(ARE_BUILT) /* only devices that the pin map has can be switched on */
    case PARAMETER_BAUD_RATE:
      return is_baud_rate(kept);
    default:
      return true;
  }
}

void parameters_start(void) {
  has_host_come = false;
  parameters_reset();
}

void parameters_reset(void) { hal_table_copy(values, initials, sizeof values); }

uint16_t parameters_u16(uint8_t parameter) { return values[parameter]; }

int16_t parameters_i16(uint8_t parameter) { return (int16_t)values[parameter]; }

__attribute__((noinline)) int32_t parameters_get(uint8_t parameter) {
  return parameter < PARAMETER_COUNT ? decoded(values[parameter], range_of(parameter)) : 0;
}

uint8_t parameters_set(uint8_t parameter, int32_t value) {
  if (parameter >= PARAMETER_COUNT) {
    return ANSWER_STATUS_UNKNOWN_PARAMETER;
  }
  const parameter_range range = range_of(parameter);
  const uint16_t kept = (uint16_t)value;
  if (decoded(kept, range) != value || !is_allowed(parameter, kept, range)) {
    return ANSWER_STATUS_OUT_OF_RANGE;
  }
  values[parameter] = kept;
  return ANSWER_STATUS_OK;
}

#define SHIFTED(name, first) | (device_set)((device_set)values[PARAMETER_##name] << (first))
device_set parameters_devices(void) { return 0 DEVICES_LIST(SHIFTED); }
#undef SHIFTED

bool parameters_device_on(device_set device) { return (parameters_devices() & device) != 0; }

bool parameters_device_in_use(device_set device) {
  return parameters_device_on(device) && (has_host_come || values[PARAMETER_FALLBACK_AT_START] != 0);
}

void parameters_host_has_come(void) { has_host_come = true; }

const uint16_t *parameters_values(void) { return values; }

bool parameters_restore(const uint16_t *kept) {
  for (uint8_t parameter = 0; parameter < PARAMETER_COUNT; parameter++) {
    if (!is_allowed(parameter, kept[parameter], range_of(parameter))) {
      return false;
    }
  }
  memcpy(values, kept, sizeof values);
  return true;
}
