/* turret.h: the servo that turns the turret. Its pulses come in the fifth slot of the servo frame (servo.h):
 *
 *   pulse = turret_centre + turret_gain * angle       clamped to 600..2400 us
 *
 * It holds the last angle until it is released: by its own message, and by each stop of the motors (safety.h). */
#ifndef TURRET_H
#define TURRET_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"

void turret_start(void);

/* Turns to an angle in 1/10000 rad, -16000..16000. */
void turret_hold(int16_t angle);

/* No pulses from the next servo frame on. */
void turret_release(void);

/* Fills in its fields of devices_telemetry; false: it is off. */
bool turret_report_devices_telemetry(msg_devices_telemetry *message);

#endif
