/* buzzer.h: a piezo speaker. Timer0 toggles its pin (hal.h); a tone has a frequency and a length and ends by itself. */
#ifndef BUZZER_H
#define BUZZER_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"

#define BUZZER_FREQUENCY_MIN 40u   /* Hz */
#define BUZZER_FREQUENCY_MAX 8000u /* two interrupts a period */

void buzzer_start(void);

/* The tone at start, if there shall be one; after hal_start_timers(). Only its own end silences it. */
void buzzer_start_beep(void);

/* A new session: no token has been heard. */
void buzzer_start_session(void);

/* A tone for a number of ticks, or silence (frequency or length 0), unless its token is the last one's. False if it is refused:
 * switched off, or no such frequency. */
bool buzzer_tone(uint16_t frequency, uint8_t ticks, uint8_t token);

/* Ends a tone. */
void buzzer_silence(void);

/* Fills in its fields of devices_telemetry; false: it is off. */
bool buzzer_report_devices_telemetry(msg_devices_telemetry *message);

#endif
