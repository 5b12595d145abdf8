/* analog_infrared.h: the Sharp distance sensor, at the analog converter (analog.h). */
#ifndef ANALOG_INFRARED_H
#define ANALOG_INFRARED_H

#include <stdbool.h>

#include "generated/messages.h"

void analog_infrared_start(void);

/* Fills in its fields of devices_telemetry; false: it is off. */
bool analog_infrared_report_devices_telemetry(msg_devices_telemetry *message);

#endif
