/* light.h: light sensors, read by the time in which a phototransistor discharges a capacitor (Robotics with the Board of
 * Education Shield, chapter 6): charge for a slot, let go, and take the time until the input reads low: the brighter, the
 * shorter. Both sides at once, once in each servo frame (20 ms): charged in its last slot, let go in its first.
 *
 * Nothing waits for the edge: the left line's is stamped with the changes of port C (pin_changes.h), the right one's by the
 * pin change of port D. On a map with the left sensor on pin 8 the timer captures its edge. */
#ifndef LIGHT_H
#define LIGHT_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"

#define LIGHT_LONGEST 14000u /* us */

void light_start(void);

/* The pin of port C whose changes are wanted now; 0: none. */
uint8_t light_pins(void);

/* It has changed at clock_now() `time`; `bits` are the levels of the port. Main loop only. */
void light_on_pin_change(uint8_t bits, uint32_t time);

/* These pins are noise: their edge is awaited no more. */
void light_mask(uint8_t pins);

/* Fills in its fields of devices_telemetry; false: it is off. */
bool light_report_devices_telemetry(msg_devices_telemetry *message);

#endif
