/* ping.h: the Ping))) distance sensor on the input-capture pin. Every ping_period ticks a 5 us trigger; after a hold-off of
 * 750 us the sensor raises the same pin for as long as the sound travels, 115 us to 18.5 ms. Both edges are captured by the
 * timer.
 *
 * An edge at another time than the hold-off's end is noise. Without a rising edge, or with a pulse that has not ended 20 ms
 * after the trigger, the sensor is absent: it ends its pulse after 18.5 ms if it hears nothing. A pulse shorter than any echo,
 * or that ended before its end was looked for, is one of something too near.
 *
 * The board holds the line low between two measurements. While it awaits an echo the line is an input without pull-up, for no
 * data sheet says what the sensor does to it in the hold-off; so the line of an absent Ping floats for 20 ms after each
 * trigger. */
#ifndef PING_H
#define PING_H

#include <stdint.h>

#include "generated/messages.h"

void ping_start(void);

/* Fills in its fields of telemetry. */
void ping_report_telemetry(msg_telemetry *message);

#endif
