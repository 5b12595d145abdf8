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

#ifdef __cplusplus
extern "C" {
#endif

#define MOTION_PULSE_MIN 20800u /* 1300 us in cycles */
#define MOTION_PULSE_MAX 27200u /* 1700 us */

/* gain * signal / 10000, to 0.6 of a count; |gain| and |signal| up to 16000. */
int32_t motion_offset(int16_t gain, int16_t signal);

/* The pulse of one wheel in cycles, to 0.6 of a cycle. centre and gain (-3200..3200) in cycles, signal in 1/10000. */
uint16_t motion_pulse(int32_t centre, int16_t gain, int16_t signal);

/* The signal in 1/10000 for a speed; both speeds in the same unit, maximum > 0. */
int16_t motion_signal_of_speed(int16_t speed, int16_t maximum);

/* What set-points of speeds are turned into follows the parameters as they are now: at the start, and when they have
 * changed. */
void motion_use_parameters(void);

/* Set-points into pulses. */
void motion_signals(int16_t left, int16_t right);
void motion_speeds(int16_t left, int16_t right);

/* No pulses. */
void motion_off(void);

#ifdef __cplusplus
}
#endif

#endif
