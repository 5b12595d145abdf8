/* supply.c: see supply.h. The converter measures the bandgap with the supply as its reference, so that
 *   result = bandgap * 1024 / supply     (24.7)     and     supply = bandgap * 1024 / result.
 * A step of the result is 22 mV at 5 V. */
#include "supply.h"

#include "analog.h"
#include "hal/hal.h"
#include "parameters.h"
#include "tasks.h"

#define HYSTERESIS 100u /* mV */
#define RESULT_MIN 32u  /* 35 V: no result of a chip that works */

static uint16_t voltage;
static bool low;
static bool was_below;   /* the last measurement was */
static bool has_settled; /* a measurement since power was given to bandgap and converter is past */

void supply_start(void) {
  voltage = 0;
  low = was_below = has_settled = false;
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

/* In every tick: judges the last measurement (analog.h). */
void supply_task(void) {
  const uint16_t result = analog_take_bandgap();
  if (result < RESULT_MIN) {
    return;
  }
  if (!has_settled) { /* the first conversion after the reference was chosen may be wrong (24.5.2) */
    has_settled = true;
    return;
  }
  voltage = (uint16_t)(parameters_u16(PARAMETER_BANDGAP) * 1024ul / result);
  judge(parameters_u16(PARAMETER_SUPPLY_MINIMUM));
}

uint16_t supply_voltage(void) { return voltage; }

void supply_report_telemetry(msg_telemetry *message) { message->supply = voltage; }

bool supply_report_devices_telemetry(msg_devices_telemetry *message) {
  message->supply = voltage;
  return false;
}

bool supply_low(void) { return low; }
