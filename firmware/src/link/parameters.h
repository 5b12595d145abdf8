/* parameters.h: what can be set at run time; names, ranges and defaults come from messages.toml and the robot's
 * description (generated/parameters.h). A value lasts until the next reset. Units: counts of the parameter's scale. */
#ifndef LINK_PARAMETERS_H
#define LINK_PARAMETERS_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/parameters.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Devices that this firmware can run; only they can be switched on. */
#define PARAMETERS_DEVICES_BUILT \
  (DEVICES_SERVOS | DEVICES_ENCODERS | DEVICES_WHISKERS | DEVICES_INFRARED | DEVICES_PING)

/* All values to their defaults. */
void parameters_start(void);

/* The value in force; 0 for a number that is no parameter. */
int32_t parameters_get(uint8_t parameter);

/* Returns a PARAMETER_STATUS_...; the value changes only on PARAMETER_STATUS_OK. */
uint8_t parameters_set(uint8_t parameter, int32_t value);

/* Whether a device (DEVICES_... bit) is switched on. */
bool parameters_device_on(uint16_t device);

#ifdef __cplusplus
}
#endif

#endif
