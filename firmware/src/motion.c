/* motion.c: see motion.h. */
#include "motion.h"

#include "division.h"
#include "generated/parameters.h"
#include "link/parameters.h"
#include "servo.h"

#define FULL 10000u /* a signal of 1 */

/* numerator / 2^bits, rounded to nearest, halves away from zero. */
static inline __attribute__((always_inline)) int32_t shift(int32_t numerator, uint8_t bits) {
  const int32_t half = (int32_t)1 << (bits - 1u);
  return numerator < 0 ? -((half - numerator) >> bits) : (numerator + half) >> bits;
}

static int32_t clamp(int32_t value, int32_t low, int32_t high) {
  return value < low ? low : value > high ? high : value;
}

int32_t motion_offset(int32_t gain, int16_t signal) {
  /* Two divisions would take a fifth of the time between two set-points on a full line: 26844 / 2^12 is 2^16 / 10000 to
   * 2e-5. */
  const int32_t part = shift((int32_t)signal * 26844, 12); /* signal in 1/65536 */
  return shift(gain * part, 16);
}

uint16_t motion_pulse(int32_t centre, int32_t gain, int16_t signal) {
  return (uint16_t)clamp(centre + motion_offset(gain, signal), MOTION_PULSE_MIN, MOTION_PULSE_MAX);
}

/* Signals per speed at a maximum: FULL * 2^17 / maximum; at most 2^31 when it is multiplied by a maximum. A division takes
 * 600 cycles, and on a full line there are 5,000 for each set-point: it is made anew only for another maximum. */
static int32_t signal_per_speed(int16_t maximum) {
  static int16_t divisor; /* the maximum at which */
  static int32_t quotient;
  if (maximum != divisor) {
    divisor = maximum;
    quotient = (int32_t)(divide(FULL, (uint16_t)maximum, 18) + 1u) >> 1; /* rounded to nearest */
  }
  return quotient;
}

/* Right to half a count and 2e-6 of it. */
static __attribute__((noinline)) int16_t signal_of(int16_t speed, int16_t maximum, int32_t quotient) {
  const int16_t within = speed > maximum ? maximum : speed < -maximum ? (int16_t)-maximum : speed;
  return (int16_t)shift(within * quotient, 17);
}

int16_t motion_signal_of_speed(int16_t speed, int16_t maximum) {
  return signal_of(speed, maximum, signal_per_speed(maximum));
}

void motion_signals(int16_t left, int16_t right) {
  servo_set(
      motion_pulse(parameters_u16(PARAMETER_SERVO_LEFT_CENTRE), parameters_i16(PARAMETER_SERVO_LEFT_GAIN), left),
      motion_pulse(parameters_u16(PARAMETER_SERVO_RIGHT_CENTRE), parameters_i16(PARAMETER_SERVO_RIGHT_GAIN), right));
}

void motion_speeds(int16_t left, int16_t right) {
  const int16_t maximum = (int16_t)parameters_u16(PARAMETER_WHEEL_SPEED_MAXIMUM); /* up to 5000 */
  const int32_t quotient = signal_per_speed(maximum);
  motion_signals(signal_of(left, maximum, quotient), signal_of(right, maximum, quotient));
}

void motion_off(void) { servo_set(0, 0); }
