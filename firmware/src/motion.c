/* motion.c: see motion.h. */
#include "motion.h"

#include "parameters.h"
#include "servo.h"

#define FULL_SIGNAL 10000 /* a signal of 1 */

static int32_t clamp(int32_t value, int32_t low, int32_t high) {
  return value < low ? low : value > high ? high : value;
}

int32_t motion_offset(int16_t gain, int16_t part, int16_t full) {
  const int32_t product = (int32_t)gain * part;
  const int32_t half = full / 2;
  return (product + (product < 0 ? -half : half)) / full;
}

uint16_t motion_pulse(uint16_t centre, int16_t gain, int16_t part, int16_t full) {
  const int16_t within = (int16_t)clamp(part, -full, full);
  return (uint16_t)clamp(centre + motion_offset(gain, within, full), MOTION_PULSE_MIN, MOTION_PULSE_MAX);
}

static void set(int16_t left, int16_t right, int16_t full) {
  servo_set(
      motion_pulse(parameters_u16(PARAMETER_SERVO_LEFT_CENTRE), parameters_i16(PARAMETER_SERVO_LEFT_GAIN), left, full),
      motion_pulse(parameters_u16(PARAMETER_SERVO_RIGHT_CENTRE), parameters_i16(PARAMETER_SERVO_RIGHT_GAIN), right,
                   full));
}

void motion_signals(int16_t left, int16_t right) { set(left, right, FULL_SIGNAL); }

void motion_speeds(int16_t left, int16_t right) {
  set(left, right, (int16_t)parameters_u16(PARAMETER_WHEEL_SPEED_MAXIMUM)); /* up to 5000 */
}

static uint16_t pulse_of_eighths(uint16_t centre, int16_t gain, int8_t eighths) {
  return (uint16_t)clamp((int32_t)centre + gain * eighths / 8, MOTION_PULSE_MIN, MOTION_PULSE_MAX);
}

void motion_eighths(int8_t left, int8_t right) {
  servo_set(
      pulse_of_eighths(parameters_u16(PARAMETER_SERVO_LEFT_CENTRE), parameters_i16(PARAMETER_SERVO_LEFT_GAIN), left),
      pulse_of_eighths(parameters_u16(PARAMETER_SERVO_RIGHT_CENTRE), parameters_i16(PARAMETER_SERVO_RIGHT_GAIN),
                       right));
}

void motion_off(void) { servo_set(0, 0); }
