/* parameters.h: the run-time parameters, from protocol/messages.toml.
 * Made by protocol/generate.py; do not edit. */
#ifndef GENERATED_PARAMETERS_H
#define GENERATED_PARAMETERS_H

#define PARAMETER_DEVICES 0u /* flags: devices switched on, bits as in the devices flags */
#define PARAMETER_TIME_TO_LIVE 1u /* ms: time to live of a set-point that names none */
#define PARAMETER_SERVO_LEFT_CENTRE 2u /* 0.0625 us: pulse at which the left servo stands still */
#define PARAMETER_SERVO_RIGHT_CENTRE 3u /* 0.0625 us: pulse at which the right servo stands still */
#define PARAMETER_SERVO_LEFT_GAIN 4u /* 0.0625 us: pulse offset at full forward signal, left; negative for a mirrored servo */
#define PARAMETER_SERVO_RIGHT_GAIN 5u /* 0.0625 us: pulse offset at full forward signal, right; negative for a mirrored servo */
#define PARAMETER_WHEEL_SPEED_MAXIMUM 6u /* 0.0001 m/s: ground speed at full signal, for set-points in m/s */
#define PARAMETER_INFRARED_PERIOD 7u /* ticks: ticks between two IR readings */
#define PARAMETER_PING_PERIOD 8u /* ticks: ticks between two Ping triggers */
#define PARAMETER_ENCODER_LIMIT 9u /* edges per tick: edges of one encoder line in one tick above which the line is masked until the tick ends */
#define PARAMETER_ENCODER_COUNTS 10u /* edges: edges of one encoder line in a turn of its wheel */
#define PARAMETER_WHEEL_RADIUS 11u /* 1e-05 m: radius of the wheels; the board only keeps it */
#define PARAMETER_TRACK_WIDTH 12u /* 1e-05 m: distance between the wheels; the board only keeps it */
#define PARAMETER_TELEMETRY_PERIOD 13u /* ticks: ticks between two telemetry messages, where the baud rate allows it */
#define PARAMETER_SESSION_TIME_OUT 14u /* ms: silence of the host after which the session ends and the motors are latched off */
#define PARAMETER_RETRY_TIME 15u /* ms: time after which an unacknowledged event is sent again; 0: follows from tick and baud rate */
#define PARAMETER_SUPPLY_MINIMUM 16u /* 0.001 V: supply below which motors and EEPROM writes are refused; 0: never */
#define PARAMETER_BANDGAP 17u /* 0.001 V: this chip's bandgap voltage, against which the supply is measured */
#define PARAMETER_BAUD_RATE 18u /* 100 bit/s: rate of the serial line after the next reset: 9600, 19200, 38400, 57600, 115200, 250000, 500000 or 1000000 */
#define PARAMETER_INFRARED_SWEEP 19u /* flag: 1: bursts go through 38, 39, 40, 41 and 42 kHz in five ticks and count zones; 0: 38 kHz only */
#define PARAMETER_DEVICES_PERIOD 20u /* ticks: ticks between two devices_telemetry messages, where the baud rate allows it */
#define PARAMETER_TURRET_CENTRE 21u /* 0.0625 us: pulse at which the turret looks straight ahead */
#define PARAMETER_TURRET_GAIN 22u /* 0.0625 us/rad: pulse for each radian of the turret to the left; negative for a servo that turns the other way */
#define PARAMETER_START_BEEP 23u /* 0.01 s: length of the tone at each start, so that a reset is heard; 0: none */
#define PARAMETER_ENCODER_GAP 24u /* us: one line: an edge sooner after the last that counts does not count; two lines: it gives no period; 0: every edge counts */
#define PARAMETER_FALLBACK_AFTER 25u /* ms: silence of the host after which the board's own brain takes over; 0: never */
#define PARAMETER_FALLBACK_AT_START 26u /* flag: 1: the board's own brain may also take over after a reset, before any host has armed the motors; 0: not */
#define PARAMETER_COUNT 27u
#define PARAMETER_TABLE 0x6A0Fu /* tells tables of parameters apart */

/* X(NAME, type, min, max, default) for each; a DEFAULT_... is the robot's, from its pins header. */
#define PARAMETER_LIST(X)                                              \
  X(DEVICES, u16, 0, 2047, DEFAULT_DEVICES)                            \
  X(TIME_TO_LIVE, u16, 20, 2000, 250)                                  \
  X(SERVO_LEFT_CENTRE, u16, 22400, 25600, DEFAULT_SERVO_LEFT_CENTRE)   \
  X(SERVO_RIGHT_CENTRE, u16, 22400, 25600, DEFAULT_SERVO_RIGHT_CENTRE) \
  X(SERVO_LEFT_GAIN, i16, -3200, 3200, DEFAULT_SERVO_LEFT_GAIN)        \
  X(SERVO_RIGHT_GAIN, i16, -3200, 3200, DEFAULT_SERVO_RIGHT_GAIN)      \
  X(WHEEL_SPEED_MAXIMUM, u16, 100, 5000, DEFAULT_WHEEL_SPEED_MAXIMUM)  \
  X(INFRARED_PERIOD, u16, 2, 250, DEFAULT_INFRARED_PERIOD)             \
  X(PING_PERIOD, u16, 4, 250, DEFAULT_PING_PERIOD)                     \
  X(ENCODER_LIMIT, u16, 4, 200, 80)                                    \
  X(ENCODER_COUNTS, u16, 1, 4096, DEFAULT_ENCODER_COUNTS)              \
  X(WHEEL_RADIUS, u16, 500, 20000, DEFAULT_WHEEL_RADIUS)               \
  X(TRACK_WIDTH, u16, 2000, 60000, DEFAULT_TRACK_WIDTH)                \
  X(TELEMETRY_PERIOD, u16, 1, 100, 1)                                  \
  X(SESSION_TIME_OUT, u16, 200, 1500, 1000)                            \
  X(RETRY_TIME, u16, 0, 2000, 0)                                       \
  X(SUPPLY_MINIMUM, u16, 0, 5500, DEFAULT_SUPPLY_MINIMUM)              \
  X(BANDGAP, u16, 1000, 1200, 1100)                                    \
  X(BAUD_RATE, u16, 96, 10000, DEFAULT_BAUD_RATE)                      \
  X(INFRARED_SWEEP, u16, 0, 1, 0)                                      \
  X(DEVICES_PERIOD, u16, 1, 100, 2)                                    \
  X(TURRET_CENTRE, u16, 16000, 32000, DEFAULT_TURRET_CENTRE)           \
  X(TURRET_GAIN, i16, -16000, 16000, DEFAULT_TURRET_GAIN)              \
  X(START_BEEP, u16, 0, 100, 0)                                        \
  X(ENCODER_GAP, u16, 0, 65535, DEFAULT_ENCODER_GAP)                   \
  X(FALLBACK_AFTER, u16, 0, 65535, 0)                                  \
  X(FALLBACK_AT_START, u16, 0, 1, 0)

#endif
