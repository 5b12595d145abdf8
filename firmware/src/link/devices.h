/* devices.h: telemetry of the slow devices, beside that of every tick (telemetry.h). */
#ifndef LINK_DEVICES_H
#define LINK_DEVICES_H

#include <stdint.h>

/* Finds how often the line can carry it; after send_start(). */
void devices_start_line(void);

#endif
