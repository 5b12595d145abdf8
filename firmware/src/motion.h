/* motion.h: what the wheels shall do -> servo pulses. The only place that knows trim, mirrored mounting and limits.
 *
 *   pulse = centre + gain * signal                 signal in -1..1; gain < 0 for the mirrored servo
 *   signal = speed / wheel_speed_maximum           for set-points in m/s
 *
 * clamped to 1300..1700 us. Signal 0 with a set-point in force gives the centre pulse: the servo holds still and
 * resists. Latch, dead-man and set-points to coast give no pulses at all: a Boe-Bot servo then free-wheels (safety.h). */
#ifndef MOTION_H
#define MOTION_H

#include <stdint.h>

#define MOTION_PULSE_MIN 20800u /* 1300 us in cycles */
#define MOTION_PULSE_MAX 27200u /* 1700 us */

/* gain * part / full, rounded to nearest. full > 0 */
int32_t motion_offset(int16_t gain, int16_t part, int16_t full);

/* The pulse of one wheel in cycles, for `part` of `full` speed. centre and gain (-3200..3200) in cycles */
uint16_t motion_pulse(uint16_t centre, int16_t gain, int16_t part, int16_t full);

/* Set-points into pulses: signals in 1/10000, speeds in 1/10000 m/s. */
void motion_signals(int16_t left, int16_t right);
void motion_speeds(int16_t left, int16_t right);
void motion_eighths(int8_t left, int8_t right); /* of a full signal, -8..8 */

/* No pulses. */
void motion_off(void);

#endif
