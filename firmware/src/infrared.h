/* infrared.h: the two IR pairs. Every infrared_period ticks each LED gives a 1 ms burst of 38 kHz, left in the third slot of
 * the tick and right in the fourth; at its end the receiver is sampled: its output is low when an object reflects the burst.
 * A receiver that was low before the burst is stuck, or sees another light: it shows no object.
 *
 * With the parameter infrared_sweep on, the bursts of four more ticks follow at 39, 40, 41 and 42 kHz, at which the receiver
 * is less and less sensitive: the nearer the object, the more of the five show it. Their number is the zone, 0 to 5. */
#ifndef INFRARED_H
#define INFRARED_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"

void infrared_start(void);

/* INFRARED_... bits of the last reading. */
uint8_t infrared_read(void);

/* Its age in ticks; 255: none yet, or older. */
uint8_t infrared_age(void);

/* Fills in its fields of devices_telemetry; false: it is off. */
bool infrared_report_devices_telemetry(msg_devices_telemetry *message);

/* In an interrupt: a side's slot begins. */
void infrared_begin(uint8_t side);

/* Fills in its fields of telemetry. */
void infrared_report_telemetry(msg_telemetry *message);

#endif
