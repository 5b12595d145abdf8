/* messages.h: every message of the protocol, from protocol/messages.toml.
 * Made by protocol/generate.py; do not edit. */
#ifndef GENERATED_MESSAGES_H
#define GENERATED_MESSAGES_H

#include <stdint.h>

#define PROTOCOL_VERSION 1u
#define SCHEMA_HASH 0xAE513ACDul
#define MESSAGE_PAYLOAD_MAX 44u /* bytes */
#define MESSAGE_PAYLOAD_MAX_TO_BOARD 8u /* bytes */

/* Whiskers, debounced: a set bit is a pressed whisker. */
#define WHISKERS_LEFT (1u << 0)
#define WHISKERS_RIGHT (1u << 1)

/* IR pairs at the last burst: a set bit is an object seen. */
#define INFRARED_LEFT (1u << 0)
#define INFRARED_RIGHT (1u << 1)

/* State and faults of the board. */
#define STATUS_MOTORS_ENABLED (1u << 0)
#define STATUS_DEAD_MAN (1u << 1)
#define STATUS_STOPPED (1u << 2)
#define STATUS_ENCODER_LEFT_MASKED (1u << 3)
#define STATUS_ENCODER_RIGHT_MASKED (1u << 4)
#define STATUS_TICK_OVERRUN (1u << 5)
#define STATUS_RECEIVE_OVERRUN (1u << 6)
#define STATUS_WATCHDOG_RESET (1u << 7)

/* Devices switched on. */
#define DEVICES_SERVOS (1u << 0)
#define DEVICES_ENCODERS (1u << 1)
#define DEVICES_WHISKERS (1u << 2)
#define DEVICES_INFRARED (1u << 3)
#define DEVICES_PING (1u << 4)
#define DEVICES_BATTERY (1u << 5)
#define DEVICES_LIGHT (1u << 6)
#define DEVICES_ANALOG_INFRARED (1u << 7)
#define DEVICES_COMPASS (1u << 8)
#define DEVICES_TURRET (1u << 9)
#define DEVICES_BUZZER (1u << 10)

/* Why the microcontroller started. */
enum {
  RESET_CAUSE_UNKNOWN = 0,
  RESET_CAUSE_POWER = 1,
  RESET_CAUSE_EXTERNAL = 2,
  RESET_CAUSE_BROWN_OUT = 3,
  RESET_CAUSE_WATCHDOG = 4,
};

/* How a parameter request ended. */
enum {
  PARAMETER_STATUS_OK = 0,
  PARAMETER_STATUS_UNKNOWN_PARAMETER = 1,
  PARAMETER_STATUS_OUT_OF_RANGE = 2,
};

/* Asks the board to say hello. */
#define MSG_HELLO_REQUEST_ID 0x01u
#define MSG_HELLO_REQUEST_LENGTH 1u
typedef struct __attribute__((packed)) {
  uint8_t protocol_version; /* version that the host speaks */
} msg_hello_request;

/* Asks for the identity message. */
#define MSG_IDENTIFY_ID 0x02u
#define MSG_IDENTIFY_LENGTH 0u

/* Motor signals: -1 full backward, 0 stop, +1 full forward. */
#define MSG_SETPOINT_SIGNAL_ID 0x10u
#define MSG_SETPOINT_SIGNAL_LENGTH 8u
typedef struct __attribute__((packed)) {
  int16_t left; /* 0.0001 1 */
  int16_t right; /* 0.0001 1 */
  uint16_t time_to_live; /* ms; motors stop when no newer set-point came within this time */
  uint16_t answers_tick; /* low 16 bits of the tick whose observation this answers */
} msg_setpoint_signal;
#define MSG_SETPOINT_SIGNAL_LEFT_MIN (-10000)
#define MSG_SETPOINT_SIGNAL_LEFT_MAX (10000)
#define MSG_SETPOINT_SIGNAL_RIGHT_MIN (-10000)
#define MSG_SETPOINT_SIGNAL_RIGHT_MAX (10000)
#define MSG_SETPOINT_SIGNAL_TIME_TO_LIVE_MIN (1)
#define MSG_SETPOINT_SIGNAL_TIME_TO_LIVE_MAX (2000)

/* Wheel speeds along the ground, forward positive; the board turns them into pulses by its stored curve. */
#define MSG_SETPOINT_SPEED_ID 0x11u
#define MSG_SETPOINT_SPEED_LENGTH 8u
typedef struct __attribute__((packed)) {
  int16_t left; /* 0.0001 m/s */
  int16_t right; /* 0.0001 m/s */
  uint16_t time_to_live; /* ms */
  uint16_t answers_tick; /* low 16 bits of the tick whose observation this answers */
} msg_setpoint_speed;
#define MSG_SETPOINT_SPEED_LEFT_MIN (-5000)
#define MSG_SETPOINT_SPEED_LEFT_MAX (5000)
#define MSG_SETPOINT_SPEED_RIGHT_MIN (-5000)
#define MSG_SETPOINT_SPEED_RIGHT_MAX (5000)
#define MSG_SETPOINT_SPEED_TIME_TO_LIVE_MIN (1)
#define MSG_SETPOINT_SPEED_TIME_TO_LIVE_MAX (2000)

/* Stops the motors at once, until the next set-point. */
#define MSG_STOP_ID 0x12u
#define MSG_STOP_LENGTH 0u

/* Asks for one parameter. */
#define MSG_GET_PARAMETER_ID 0x20u
#define MSG_GET_PARAMETER_LENGTH 1u
typedef struct __attribute__((packed)) {
  uint8_t parameter; /* number of the parameter */
} msg_get_parameter;

/* Sets one parameter until the next reset. */
#define MSG_SET_PARAMETER_ID 0x21u
#define MSG_SET_PARAMETER_LENGTH 5u
typedef struct __attribute__((packed)) {
  uint8_t parameter; /* number of the parameter */
  int32_t value; /* in counts of the parameter's scale */
} msg_set_parameter;

/* Sent after every reset and on request: who speaks, and which contract. */
#define MSG_HELLO_ID 0x80u
#define MSG_HELLO_LENGTH 28u
typedef struct __attribute__((packed)) {
  uint8_t protocol_version;
  uint32_t schema_hash; /* CRC-32 of the normalised messages.toml */
  uint16_t tick_rate; /* Hz */
  uint32_t devices; /* devices */
  uint8_t reset_cause; /* reset_cause */
  char pin_map[16]; /* name of the pin map that the image was built for */
} msg_hello;

/* Which image runs. */
#define MSG_IDENTITY_ID 0x81u
#define MSG_IDENTITY_LENGTH 44u
typedef struct __attribute__((packed)) {
  char firmware_version[12];
  char compiler[24];
  uint32_t image_size; /* B; bytes of flash that the image fills; 0 where there is no flash */
  uint32_t image_hash; /* CRC-32 of those bytes as read back from flash; 0 where there is no flash */
} msg_identity;

/* Answer to get_parameter and set_parameter: the value now in force. */
#define MSG_PARAMETER_ID 0x82u
#define MSG_PARAMETER_LENGTH 6u
typedef struct __attribute__((packed)) {
  uint8_t parameter; /* number of the parameter */
  int32_t value; /* in counts of the parameter's scale */
  uint8_t status; /* parameter_status */
} msg_parameter;

/* Everything the board knows, once per control tick. */
#define MSG_TELEMETRY_ID 0x90u
#define MSG_TELEMETRY_LENGTH 35u
typedef struct __attribute__((packed)) {
  uint32_t tick; /* control ticks since reset */
  uint32_t time; /* us; board time at the start of this tick since reset; rolls over after 71.6 min */
  int32_t encoder_left; /* edges; edges since reset; signed only where the encoder knows direction */
  int32_t encoder_right; /* edges */
  uint16_t edge_period_left; /* 16 us; time between the last two edges; 0: none within 0.5 s */
  uint16_t edge_period_right; /* 16 us */
  uint8_t whiskers; /* whiskers */
  uint8_t infrared; /* infrared */
  uint8_t infrared_age; /* ticks; age of the older IR reading; 255: never or older */
  uint16_t ping_echo; /* us; length of the last echo pulse; 0: no echo */
  uint8_t ping_age; /* ticks; ticks since that echo ended or was given up; 255: never or older */
  uint16_t pulse_left; /* 0.0625 us; servo pulse in force; 0: no pulses */
  uint16_t pulse_right; /* 0.0625 us */
  uint16_t status; /* status */
  uint8_t setpoint_sequence; /* sequence number of the last set-point that was accepted */
  uint8_t frames_bad; /* frames refused since reset, modulo 256 */
  uint8_t overruns; /* control ticks overrun since reset, modulo 256 */
} msg_telemetry;

/* Payload bytes of the message, or -1 if there is no such message. */
static inline int16_t message_length(uint8_t id) {
  switch (id) {
    case MSG_HELLO_REQUEST_ID:
      return MSG_HELLO_REQUEST_LENGTH;
    case MSG_IDENTIFY_ID:
      return MSG_IDENTIFY_LENGTH;
    case MSG_SETPOINT_SIGNAL_ID:
      return MSG_SETPOINT_SIGNAL_LENGTH;
    case MSG_SETPOINT_SPEED_ID:
      return MSG_SETPOINT_SPEED_LENGTH;
    case MSG_STOP_ID:
      return MSG_STOP_LENGTH;
    case MSG_GET_PARAMETER_ID:
      return MSG_GET_PARAMETER_LENGTH;
    case MSG_SET_PARAMETER_ID:
      return MSG_SET_PARAMETER_LENGTH;
    case MSG_HELLO_ID:
      return MSG_HELLO_LENGTH;
    case MSG_IDENTITY_ID:
      return MSG_IDENTITY_LENGTH;
    case MSG_PARAMETER_ID:
      return MSG_PARAMETER_LENGTH;
    case MSG_TELEMETRY_ID:
      return MSG_TELEMETRY_LENGTH;
    default:
      return -1;
  }
}

#endif
