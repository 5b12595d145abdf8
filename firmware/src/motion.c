/* motion.c: see motion.h. */
#include "motion.h"

#include "division.h"
#include "generated/parameters.h"
#include "link/parameters.h"
#include "servo.h"

#define FULL 10000u /* a signal of 1 */

#define HALF ((int32_t)1 << 15) /* of what a shift by 16 bits leaves out */

/* numerator / 2^16, rounded to nearest, halves away from zero. */
static inline __attribute__((always_inline)) int32_t high(int32_t numerator) {
  return (numerator + HALF - (numerator < 0 ? 1 : 0)) >> 16;
}

static int32_t clamp(int32_t value, int32_t low, int32_t high) {
  return value < low ? low : value > high ? high : value;
}

int32_t motion_offset(int16_t gain, int16_t signal) {
  /* Two divisions would take a fifth of the time between two set-points on a full line, and shifts by anything but 8 or 16
   * bits a tenth: 6 + 36281 / 2^16 is 2^16 / 10000 to 1e-6. */
  const int32_t part = signal * (int32_t)6 + (int16_t)high(signal * (int32_t)36281); /* signal in 1/65536 */
  return high(gain * part);
}

uint16_t motion_pulse(int32_t centre, int16_t gain, int16_t signal) {
  return (uint16_t)clamp(centre + motion_offset(gain, signal), MOTION_PULSE_MIN, MOTION_PULSE_MAX);
}

/* Signals per speed at a maximum: FULL * 2^17 / maximum; at most 2^31 when it is multiplied by a maximum. */
static int32_t signal_per_speed(uint16_t maximum) {
  return (int32_t)(divide(FULL, maximum, 18) + 1u) >> 1; /* rounded to nearest */
}

/* A division takes 600 cycles, and on a full line there are 2,400 for each set-point: it is made with the parameter. */
static uint16_t speed_maximum; /* as in the parameters, and */
static int32_t of_maximum;     /* signal_per_speed() at it */

void motion_use_parameters(void) {
  const uint16_t maximum = parameters_u16(PARAMETER_WHEEL_SPEED_MAXIMUM); /* up to 5000 */
  if (maximum != speed_maximum) {
    speed_maximum = maximum;
    of_maximum = signal_per_speed(maximum);
  }
}

/* Right to half a count and 2e-6 of it. */
static __attribute__((noinline)) int16_t signal_of(int16_t speed, int16_t maximum, int32_t quotient) {
  const int16_t within = speed > maximum ? maximum : speed < -maximum ? (int16_t)-maximum : speed;
  return (int16_t)((int16_t)((within * quotient + 2 * HALF) >> 16) >> 1); /* by 17, which would take a loop */
}

int16_t motion_signal_of_speed(int16_t speed, int16_t maximum) {
  return signal_of(speed, maximum, signal_per_speed((uint16_t)maximum));
}

void motion_signals(int16_t left, int16_t right) {
  servo_set(
      motion_pulse(parameters_u16(PARAMETER_SERVO_LEFT_CENTRE), parameters_i16(PARAMETER_SERVO_LEFT_GAIN), left),
      motion_pulse(parameters_u16(PARAMETER_SERVO_RIGHT_CENTRE), parameters_i16(PARAMETER_SERVO_RIGHT_GAIN), right));
}

void motion_speeds(int16_t left, int16_t right) {
  const int16_t maximum = (int16_t)speed_maximum;
  motion_signals(signal_of(left, maximum, of_maximum), signal_of(right, maximum, of_maximum));
}

void motion_off(void) { servo_set(0, 0); }
