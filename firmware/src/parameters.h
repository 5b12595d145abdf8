/* parameters.h: what can be set at run time; names, types, ranges and defaults come from messages.toml and the robot's
 * description (generated/parameters.h). A value lasts until the next reset, unless it is saved (storage.h). Units: counts
 * of the parameter's scale. */
#ifndef PARAMETERS_H
#define PARAMETERS_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/parameters.h"

/* At start: defaults, and no host has come. */
void parameters_start(void);

/* All values to their defaults. */
void parameters_reset(void);

/* The value in force of a parameter of that type. Cheap; `parameter` must be one. */
uint16_t parameters_u16(uint8_t parameter);
int16_t parameters_i16(uint8_t parameter);

/* The value in force of a parameter of any type; 0 for a number that is no parameter. */
int32_t parameters_get(uint8_t parameter);

/* Returns an ANSWER_STATUS_...; the value changes only on ANSWER_STATUS_OK. */
uint8_t parameters_set(uint8_t parameter, int32_t value);

/* The devices (DEVICES_... bits) that are switched on, and whether one is. */
device_set parameters_devices(void);
bool parameters_device_on(device_set device);

/* Whether it may also drive its pins: only after a host has opened a session, as other devices may be wired to the board,
 * or where the board's own brain may begin by itself. */
bool parameters_device_in_use(device_set device);
void parameters_host_has_come(void);

/* All values as they are kept, PARAMETER_COUNT of them: an i16 in two's complement. */
const uint16_t *parameters_values(void);

/* Puts PARAMETER_COUNT such values in force, if each is within its range; otherwise none, and returns false. */
bool parameters_restore(const uint16_t *kept);

#endif
