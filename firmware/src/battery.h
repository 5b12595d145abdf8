/* battery.h: the pack's voltage behind a divider, at the analog converter (analog.h). */
#ifndef BATTERY_H
#define BATTERY_H

#include <stdbool.h>

#include "generated/messages.h"

void battery_start(void);

/* Fills in its fields of devices_telemetry; false: it is off. */
bool battery_report_devices_telemetry(msg_devices_telemetry *message);

#endif
