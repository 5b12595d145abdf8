/* compass.h: the compass HMC5883L on the two-wire bus (Honeywell, HMC5883L data sheet, 2010): 75 measurements a second, mean
 * of 8 samples, range 1.3 Ga (1090 counts/Ga). Its three axes are read every 40 ms. A device that does not answer is asked
 * again; a transfer that has not ended after a tick is given up, and the bus is freed by clock pulses, until the
 * device that holds the data line lets it go (NXP UM10204, 3.1.16). */
#ifndef COMPASS_H
#define COMPASS_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"

void compass_start(void);

/* Fills in its fields of devices_telemetry; false: it is off. */
bool compass_report_devices_telemetry(msg_devices_telemetry *message);

#endif
