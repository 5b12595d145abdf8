/* parameters.h: the run-time parameters, from protocol/messages.toml.
 * Made by protocol/generate.py; do not edit. */
#ifndef GENERATED_PARAMETERS_H
#define GENERATED_PARAMETERS_H

#define PARAMETER_DEVICES 0u /* flags: devices switched on, bits as in the devices flags */
#define PARAMETER_TIME_TO_LIVE_DEFAULT 1u /* ms: time to live of a set-point that names none; also the longest silence at start */
#define PARAMETER_SERVO_LEFT_CENTRE 2u /* 0.0625 us: pulse at which the left servo stands still */
#define PARAMETER_SERVO_RIGHT_CENTRE 3u /* 0.0625 us: pulse at which the right servo stands still */
#define PARAMETER_SERVO_LEFT_GAIN 4u /* 0.0625 us: pulse offset at full forward signal, left; negative for a mirrored servo */
#define PARAMETER_SERVO_RIGHT_GAIN 5u /* 0.0625 us: pulse offset at full forward signal, right; negative for a mirrored servo */
#define PARAMETER_WHEEL_SPEED_MAXIMUM 6u /* 0.0001 m/s: ground speed at full signal, for set-points in m/s */
#define PARAMETER_INFRARED_PERIOD 7u /* ticks: ticks between two IR readings */
#define PARAMETER_PING_PERIOD 8u /* ticks: ticks between two Ping triggers */
#define PARAMETER_ENCODER_LIMIT 9u /* edges per tick: edges of one encoder line in one tick above which the line is masked until the tick ends */
#define PARAMETER_COUNT 10u

/* X(NAME, id, min, max, default) for each; a DEFAULT_... is the robot's, from its pins header. */
#define PARAMETER_LIST(X)                                            \
  X(DEVICES, 0, 0, 2047, DEFAULT_DEVICES)                            \
  X(TIME_TO_LIVE_DEFAULT, 1, 20, 2000, 250)                          \
  X(SERVO_LEFT_CENTRE, 2, 22400, 25600, DEFAULT_SERVO_LEFT_CENTRE)   \
  X(SERVO_RIGHT_CENTRE, 3, 22400, 25600, DEFAULT_SERVO_RIGHT_CENTRE) \
  X(SERVO_LEFT_GAIN, 4, -3200, 3200, DEFAULT_SERVO_LEFT_GAIN)        \
  X(SERVO_RIGHT_GAIN, 5, -3200, 3200, DEFAULT_SERVO_RIGHT_GAIN)      \
  X(WHEEL_SPEED_MAXIMUM, 6, 100, 5000, DEFAULT_WHEEL_SPEED_MAXIMUM)  \
  X(INFRARED_PERIOD, 7, 2, 250, DEFAULT_INFRARED_PERIOD)             \
  X(PING_PERIOD, 8, 4, 250, DEFAULT_PING_PERIOD)                     \
  X(ENCODER_LIMIT, 9, 4, 200, 80)

#endif
