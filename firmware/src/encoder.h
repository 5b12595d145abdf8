/* encoder.h: wheel encoders: counts of edges and the time between the last two (notes, section 1.4).
 *
 * One line per wheel counts up whatever the direction; two lines (ENCODER_LINES 2) count down when the wheel turns
 * backward. Forward is A leading B: (A, B) runs 00, 10, 11, 01. The pin map says which it is.
 *
 * A sensor may bounce. With one line, an edge sooner than the parameter encoder_gap after the wheel's last one does not count,
 * nor does one that only brings the line back to where it was. With two lines every edge counts, as the steps of a bounce
 * cancel; an edge sooner than encoder_gap only gives no period. Speed is the time between edges that give one.
 * A line that fires more often in a tick than the parameter encoder_limit allows, or that is found to be noise
 * (pin_changes.h), is masked until the next tick. What it did meanwhile is not known: it gives no period, neither then nor
 * across the gap. */
#ifndef ENCODER_H
#define ENCODER_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"

#define ENCODER_TIME_UNIT 256u /* cycles in 16 us */

void encoder_start(void);

/* The pins of port C that count now. */
uint8_t encoder_pins(void);

/* Of these, `changed` have changed at `time`, in 16 us modulo 2^16, and `bits` are the levels of the port. Main loop only. */
void encoder_on_change(uint8_t changed, uint8_t bits, uint16_t time);

/* These pins count from now on, from these levels. */
void encoder_set_levels(uint8_t pins, uint8_t bits);

/* The times of this tick's edges are not known: it gives no period. */
void encoder_lose_time(void);

/* These pins are noise: masked until the next tick. */
void encoder_mask(uint8_t pins);

/* A tick begins: all pins count again. Once, before encoder_task(), which reports what was masked. */
void encoder_lift_masks(void);

/* Edges since reset, at the start of this tick. */
int32_t encoder_count(uint8_t side);

/* Fills in its fields of telemetry: the readings at the start of this tick. */
void encoder_report_telemetry(msg_telemetry *message);

#endif
