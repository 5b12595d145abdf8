/* messages.h: the layout of every message of the protocol, from protocol/messages.toml.
 * Made by protocol/generate.py; do not edit. */
#ifndef GENERATED_MESSAGES_H
#define GENERATED_MESSAGES_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/values.h"

#define PROTOCOL_VERSION 0x30u /* 3.0 */
#define PROTOCOL_MAJOR(version) ((version) / 16u)
#define SCHEMA_HASH 0x0A648E33ul
#define MESSAGE_PAYLOAD_MAX_TO_BOARD 9u /* bytes */
#define MESSAGE_PAYLOAD_MAX_TO_HOST 60u /* bytes */

/* Opens a session with the seed (board_nonce XOR host_nonce), or confirms the one that has it. */
#define MSG_OPEN_ID 0x01u
#define MSG_OPEN_LENGTH 9u
typedef struct __attribute__((packed)) {
  uint8_t protocol_version; /* of the host: 16 x version + minor */
  uint32_t board_nonce; /* as in the hello that this answers; another one is refused */
  uint32_t host_nonce; /* drawn by the host for each session */
} msg_open;
#define MSG_OPEN_BOARD_NONCE_MIN (0)
#define MSG_OPEN_BOARD_NONCE_MAX (2097151)
#define MSG_OPEN_HOST_NONCE_MIN (0)
#define MSG_OPEN_HOST_NONCE_MAX (2097151)

/* Asks for the identity. */
#define MSG_IDENTIFY_ID 0x02u
#define MSG_IDENTIFY_LENGTH 0u

/* Asks how the board understands one message, to name what differs when the schema hashes do. */
#define MSG_DESCRIBE_ID 0x03u
#define MSG_DESCRIBE_LENGTH 5u
typedef struct __attribute__((packed)) {
  uint8_t index; /* 0, 1, ... in order of ids */
  uint32_t board_nonce; /* as in the last hello; another one is refused */
} msg_describe;
#define MSG_DESCRIBE_BOARD_NONCE_MIN (0)
#define MSG_DESCRIBE_BOARD_NONCE_MAX (2097151)

/* Who speaks, which contract, which session. Sent on its own (see Session) and in answer to open. */
#define MSG_HELLO_ID 0x80u
#define MSG_HELLO_LENGTH 44u
typedef struct __attribute__((packed)) {
  uint8_t protocol_version; /* of the board: 16 x version + minor */
  uint32_t schema_hash; /* CRC-32 of what all of this version have in common */
  uint32_t board_nonce; /* what the next open must name: another one after every start, opening and end of a session */
  uint32_t session; /* seed of the session that is open; 0: none */
  uint16_t tick_rate; /* Hz */
  uint16_t session_time_out; /* ms; silence of the host after which a session ends */
  uint8_t telemetry_period; /* ticks; ticks between two telemetry messages, as the baud rate allows */
  uint32_t boot_counter; /* number of this start: 1 + the earlier ones that ran for 10 s */
  uint8_t reset_cause; /* reset_cause */
  uint8_t parameters_saved; /* 1: the parameters in force at start came from the EEPROM; 0: they are the image's defaults */
  uint32_t devices; /* devices */
  char robot[16]; /* name of the robot that the image was built for */
} msg_hello;
#define MSG_HELLO_BOARD_NONCE_MIN (0)
#define MSG_HELLO_BOARD_NONCE_MAX (2097151)
#define MSG_HELLO_SESSION_MIN (0)
#define MSG_HELLO_SESSION_MAX (2097151)

/* Which image runs. */
#define MSG_IDENTITY_ID 0x81u
#define MSG_IDENTITY_LENGTH 60u
typedef struct __attribute__((packed)) {
  char firmware_version[12];
  char compiler[24];
  char pin_map[16]; /* name of the pin map that the image was built for */
  uint32_t image_size; /* B; bytes of flash that the image fills; 0 where there is no flash */
  uint32_t image_hash; /* CRC-32 of those bytes as read back from flash; 0 where there is no flash */
} msg_identity;

/* How the board understands one message. An index beyond the last gives id 0. */
#define MSG_DESCRIPTION_ID 0x82u
#define MSG_DESCRIPTION_LENGTH 8u
typedef struct __attribute__((packed)) {
  uint8_t index;
  uint8_t count; /* messages that the board knows */
  uint8_t id;
  uint8_t length; /* B; of the payload */
  uint32_t hash; /* of the message, as in the table */
} msg_description;

/* Stops the motors at once and latches them off until armed again. */
#define MSG_STOP_ID 0x08u
#define MSG_STOP_LENGTH 1u
typedef struct __attribute__((packed)) {
  uint8_t token; /* comes back in stopped */
} msg_stop;

/* The host leaves: the session ends at once. Not acknowledged. */
#define MSG_CLOSE_ID 0x09u
#define MSG_CLOSE_LENGTH 4u
typedef struct __attribute__((packed)) {
  uint32_t session; /* the session's seed; another one is refused */
} msg_close;
#define MSG_CLOSE_SESSION_MIN (0)
#define MSG_CLOSE_SESSION_MAX (2097151)

/* Motor signals: -1 full backward, 0 hold still, +1 full forward. */
#define MSG_SETPOINT_SIGNAL_ID 0x10u
#define MSG_SETPOINT_SIGNAL_LENGTH 8u
typedef struct __attribute__((packed)) {
  int16_t left; /* 0.0001 1 */
  int16_t right; /* 0.0001 1 */
  uint16_t time_to_live; /* ms; from the start of the answered tick; 0: the parameter time_to_live */
  uint16_t answers_tick; /* low 16 bits of the tick whose observation this answers */
} msg_setpoint_signal;
#define MSG_SETPOINT_SIGNAL_LEFT_MIN (-10000)
#define MSG_SETPOINT_SIGNAL_LEFT_MAX (10000)
#define MSG_SETPOINT_SIGNAL_RIGHT_MIN (-10000)
#define MSG_SETPOINT_SIGNAL_RIGHT_MAX (10000)
#define MSG_SETPOINT_SIGNAL_TIME_TO_LIVE_MIN (0)
#define MSG_SETPOINT_SIGNAL_TIME_TO_LIVE_MAX (2000)

/* Wheel speeds along the ground, forward positive; the board turns them into pulses by its stored curve. */
#define MSG_SETPOINT_SPEED_ID 0x11u
#define MSG_SETPOINT_SPEED_LENGTH 8u
typedef struct __attribute__((packed)) {
  int16_t left; /* 0.0001 m/s */
  int16_t right; /* 0.0001 m/s */
  uint16_t time_to_live; /* ms; from the start of the answered tick; 0: the parameter time_to_live */
  uint16_t answers_tick; /* low 16 bits of the tick whose observation this answers */
} msg_setpoint_speed;
#define MSG_SETPOINT_SPEED_LEFT_MIN (-5000)
#define MSG_SETPOINT_SPEED_LEFT_MAX (5000)
#define MSG_SETPOINT_SPEED_RIGHT_MIN (-5000)
#define MSG_SETPOINT_SPEED_RIGHT_MAX (5000)
#define MSG_SETPOINT_SPEED_TIME_TO_LIVE_MIN (0)
#define MSG_SETPOINT_SPEED_TIME_TO_LIVE_MAX (2000)

/* No pulses: the servos free-wheel. Nothing is latched. */
#define MSG_SETPOINT_COAST_ID 0x12u
#define MSG_SETPOINT_COAST_LENGTH 4u
typedef struct __attribute__((packed)) {
  uint16_t time_to_live; /* ms; from the start of the answered tick; 0: the parameter time_to_live */
  uint16_t answers_tick; /* low 16 bits of the tick whose observation this answers */
} msg_setpoint_coast;
#define MSG_SETPOINT_COAST_TIME_TO_LIVE_MIN (0)
#define MSG_SETPOINT_COAST_TIME_TO_LIVE_MAX (2000)

/* Angle of the turret, or no pulses. Refused while latched. Whatever stops the motors releases the turret. */
#define MSG_TURRET_ID 0x18u
#define MSG_TURRET_LENGTH 3u
typedef struct __attribute__((packed)) {
  int16_t angle; /* 0.0001 rad; counter-clockwise positive, 0 straight ahead */
  uint8_t hold; /* 1: turn there and hold; 0: no pulses, the servo is free */
} msg_turret;
#define MSG_TURRET_ANGLE_MIN (-16000)
#define MSG_TURRET_ANGLE_MAX (16000)
#define MSG_TURRET_HOLD_MIN (0)
#define MSG_TURRET_HOLD_MAX (1)

/* A tone, in place of the one that sounds. Whatever stops the motors silences it. */
#define MSG_BUZZER_ID 0x19u
#define MSG_BUZZER_LENGTH 4u
typedef struct __attribute__((packed)) {
  uint16_t frequency; /* Hz; 40 to 8000; 0: silence */
  uint8_t duration; /* 0.01 s */
  uint8_t token; /* another one for each tone; the last tone's again changes nothing. 0 at the start of a session */
} msg_buzzer;
#define MSG_BUZZER_FREQUENCY_MIN (0)
#define MSG_BUZZER_FREQUENCY_MAX (8000)

/* Asks for one parameter. */
#define MSG_GET_PARAMETER_ID 0x25u
#define MSG_GET_PARAMETER_LENGTH 3u
typedef struct __attribute__((packed)) {
  uint16_t number; /* of the request: 1 for the first of a session, then one more each */
  uint8_t parameter; /* number of the parameter */
} msg_get_parameter;

/* Sets one parameter until the next reset. */
#define MSG_SET_PARAMETER_ID 0x21u
#define MSG_SET_PARAMETER_LENGTH 7u
typedef struct __attribute__((packed)) {
  uint16_t number; /* of the request */
  uint8_t parameter; /* number of the parameter */
  int32_t value; /* in counts of the parameter's scale */
} msg_set_parameter;

/* Writes all parameters to the EEPROM; answered when they are written and read back. */
#define MSG_SAVE_PARAMETERS_ID 0x22u
#define MSG_SAVE_PARAMETERS_LENGTH 2u
typedef struct __attribute__((packed)) {
  uint16_t number; /* of the request */
} msg_save_parameters;

/* All parameters to the image's defaults; what is saved stays until save_parameters. */
#define MSG_RESET_PARAMETERS_ID 0x23u
#define MSG_RESET_PARAMETERS_LENGTH 2u
typedef struct __attribute__((packed)) {
  uint16_t number; /* of the request */
} msg_reset_parameters;

/* Ends the latch: set-points that answer a later tick move the motors. Refused while the supply is low or not yet measured. */
#define MSG_ARM_ID 0x24u
#define MSG_ARM_LENGTH 3u
typedef struct __attribute__((packed)) {
  uint16_t number; /* of the request */
  uint8_t latches; /* as in the telemetry that the host knows; refused (latched_again) if there has been another since */
} msg_arm;

/* The event of this number has arrived. */
#define MSG_ACKNOWLEDGE_ID 0x28u
#define MSG_ACKNOWLEDGE_LENGTH 2u
typedef struct __attribute__((packed)) {
  uint16_t number; /* of the event */
} msg_acknowledge;

/* Asks for the board's time, at once. Also keeps the session open. */
#define MSG_CLOCK_PROBE_ID 0x30u
#define MSG_CLOCK_PROBE_LENGTH 2u
typedef struct __attribute__((packed)) {
  uint16_t token; /* comes back in clock_answer */
} msg_clock_probe;

/* Answer to stop: the motors are latched off. */
#define MSG_STOPPED_ID 0x88u
#define MSG_STOPPED_LENGTH 1u
typedef struct __attribute__((packed)) {
  uint8_t token; /* of the stop */
} msg_stopped;

/* Everything the board knows, once per control tick or less often where the line is slow. */
#define MSG_TELEMETRY_ID 0x90u
#define MSG_TELEMETRY_LENGTH 39u
typedef struct __attribute__((packed)) {
  uint32_t tick; /* control ticks since reset */
  uint32_t time; /* us; board time at the start of this tick, since its clock started (about 0.2 s after a reset); rolls over after 71.6 min */
  int32_t encoder_left; /* edges; edges since reset; signed only where the encoder knows direction */
  int32_t encoder_right; /* edges */
  uint16_t edge_period_left; /* 16 us; time between the last two edges; 0: none within 0.5 s */
  uint16_t edge_period_right; /* 16 us */
  uint8_t whiskers; /* whiskers */
  uint8_t infrared; /* infrared */
  uint8_t infrared_age; /* ticks; age of the older IR reading; 255: never or older */
  uint16_t ping_echo; /* us; length of the last echo pulse where ping_status is ok, else 0 */
  uint8_t ping_age; /* ticks; ticks since that measurement ended or was given up; 255: never or older */
  uint8_t ping_status; /* ping_status */
  uint16_t pulse_left; /* 0.0625 us; servo pulse in force; 0: no pulses */
  uint16_t pulse_right; /* 0.0625 us */
  uint16_t supply; /* 0.001 V; supply voltage against the bandgap; 0: not yet measured */
  uint16_t status; /* status */
  uint8_t latch; /* latch */
  uint8_t latches; /* times that the motors were latched off since reset, repeated stops included, modulo 256 */
  uint8_t setpoint_sequence; /* sequence number of the last set-point that was accepted */
  uint8_t overruns; /* control ticks overrun since reset, modulo 256 */
} msg_telemetry;

/* What the board's end of the link has counted since reset, modulo 65536; sent in turn with task_time. */
#define MSG_COUNTERS_ID 0x91u
#define MSG_COUNTERS_LENGTH 22u
typedef struct __attribute__((packed)) {
  uint16_t good; /* frames accepted */
  uint16_t bad; /* frames refused: length, checksum, stuffing or seed */
  uint16_t unknown; /* whole frames of messages that came with a later minor version, and are ignored */
  uint16_t resynchronised; /* times that a good frame followed bad ones */
  uint16_t retransmitted; /* events sent again */
  uint16_t duplicate; /* requests that came again and were only answered */
  uint16_t overrun; /* ticks in which received bytes were lost */
  uint16_t dropped; /* messages not sent for want of room on the line */
  uint16_t late; /* set-points refused because newer ones had come or their observation was too old */
  uint16_t refused; /* whole messages refused for what they ask: out of range, out of order, while latched */
  uint16_t deferred; /* events that had to wait for room in the queue, where changes of the same kind merge */
} msg_counters;

/* The slow devices: sent every devices_period ticks or less often where the line is slow, while one of them is on. */
#define MSG_DEVICES_TELEMETRY_ID 0x92u
#define MSG_DEVICES_TELEMETRY_LENGTH 31u
typedef struct __attribute__((packed)) {
  uint32_t tick; /* control ticks since reset */
  uint16_t supply; /* 0.001 V; supply voltage, the analog readings' reference; 0: not yet measured */
  uint8_t infrared_zone_left; /* at how many of the sweep's five frequencies an object is seen */
  uint8_t infrared_zone_right;
  uint8_t infrared_zone_age; /* ticks; age of the sweep's last burst; 255: never or older */
  uint16_t battery; /* voltage at the battery's pin in 1/1024 of the supply */
  uint8_t battery_age; /* ticks; 255: never or older */
  uint16_t analog_infrared; /* voltage at the sensor's pin in 1/1024 of the supply */
  uint8_t analog_infrared_age; /* ticks; 255: never or older */
  uint16_t light_left; /* us; decay time of the light sensor, shorter in brighter light; 0: none; 14000: so long or longer */
  uint16_t light_right; /* us */
  uint8_t light_age; /* ticks; since the end of the measurement; 255: never or older */
  int16_t compass_x; /* field along the sensor's axes, raw counts; -4096: overflow */
  int16_t compass_y;
  int16_t compass_z;
  uint8_t compass_age; /* ticks; 255: never or older */
  uint8_t compass_status; /* compass_status */
  uint16_t turret_pulse; /* 0.0625 us; turret servo's pulse in force; 0: no pulses */
  uint8_t buzzer_token; /* of the last tone that was begun in this session */
} msg_devices_telemetry;
#define MSG_DEVICES_TELEMETRY_INFRARED_ZONE_LEFT_MIN (0)
#define MSG_DEVICES_TELEMETRY_INFRARED_ZONE_LEFT_MAX (5)
#define MSG_DEVICES_TELEMETRY_INFRARED_ZONE_RIGHT_MIN (0)
#define MSG_DEVICES_TELEMETRY_INFRARED_ZONE_RIGHT_MAX (5)
#define MSG_DEVICES_TELEMETRY_BATTERY_MIN (0)
#define MSG_DEVICES_TELEMETRY_BATTERY_MAX (1023)
#define MSG_DEVICES_TELEMETRY_ANALOG_INFRARED_MIN (0)
#define MSG_DEVICES_TELEMETRY_ANALOG_INFRARED_MAX (1023)
#define MSG_DEVICES_TELEMETRY_LIGHT_LEFT_MIN (0)
#define MSG_DEVICES_TELEMETRY_LIGHT_LEFT_MAX (14000)
#define MSG_DEVICES_TELEMETRY_LIGHT_RIGHT_MIN (0)
#define MSG_DEVICES_TELEMETRY_LIGHT_RIGHT_MAX (14000)

/* How long one of the firmware's tasks took at most since the session was opened; one task after another, then the counters, every 4 ticks or less often. */
#define MSG_TASK_TIME_ID 0x93u
#define MSG_TASK_TIME_LENGTH 3u
typedef struct __attribute__((packed)) {
  uint8_t task; /* task */
  uint16_t longest; /* 0.0625 us; from call to return, interrupts on top included; 65535: so long or longer; 0: it took no time, as on the native board */
} msg_task_time;

/* Answer to a numbered request. */
#define MSG_ANSWER_ID 0xA0u
#define MSG_ANSWER_LENGTH 7u
typedef struct __attribute__((packed)) {
  uint16_t number; /* of the request */
  uint8_t status; /* answer_status */
  int32_t value; /* of get_parameter and set_parameter, refused or not: the value in force, in counts of the parameter's scale; else, and where it is busy or the parameter unknown, 0 */
} msg_answer;

/* Something happened. Sent again until acknowledged. */
#define MSG_EVENT_ID 0xA1u
#define MSG_EVENT_LENGTH 9u
typedef struct __attribute__((packed)) {
  uint16_t number; /* of the event: 1 for the first of a session, then one more each */
  uint8_t kind; /* event_kind */
  uint16_t value; /* its meaning stands at each event_kind */
  uint32_t time; /* us; board time */
} msg_event;

/* Answer to clock_probe. */
#define MSG_CLOCK_ANSWER_ID 0xB0u
#define MSG_CLOCK_ANSWER_LENGTH 6u
typedef struct __attribute__((packed)) {
  uint16_t token; /* of the probe */
  uint32_t time; /* us; board time at which the probe was worked on */
} msg_clock_answer;

/* Payload bytes of a message to the board, or -1 if there is no such message. */
static inline int16_t message_length_to_board(uint8_t id) {
  switch (id) {
    case MSG_OPEN_ID:
      return MSG_OPEN_LENGTH;
    case MSG_IDENTIFY_ID:
      return MSG_IDENTIFY_LENGTH;
    case MSG_DESCRIBE_ID:
      return MSG_DESCRIBE_LENGTH;
    case MSG_STOP_ID:
      return MSG_STOP_LENGTH;
    case MSG_CLOSE_ID:
      return MSG_CLOSE_LENGTH;
    case MSG_SETPOINT_SIGNAL_ID:
      return MSG_SETPOINT_SIGNAL_LENGTH;
    case MSG_SETPOINT_SPEED_ID:
      return MSG_SETPOINT_SPEED_LENGTH;
    case MSG_SETPOINT_COAST_ID:
      return MSG_SETPOINT_COAST_LENGTH;
    case MSG_TURRET_ID:
      return MSG_TURRET_LENGTH;
    case MSG_BUZZER_ID:
      return MSG_BUZZER_LENGTH;
    case MSG_GET_PARAMETER_ID:
      return MSG_GET_PARAMETER_LENGTH;
    case MSG_SET_PARAMETER_ID:
      return MSG_SET_PARAMETER_LENGTH;
    case MSG_SAVE_PARAMETERS_ID:
      return MSG_SAVE_PARAMETERS_LENGTH;
    case MSG_RESET_PARAMETERS_ID:
      return MSG_RESET_PARAMETERS_LENGTH;
    case MSG_ARM_ID:
      return MSG_ARM_LENGTH;
    case MSG_ACKNOWLEDGE_ID:
      return MSG_ACKNOWLEDGE_LENGTH;
    case MSG_CLOCK_PROBE_ID:
      return MSG_CLOCK_PROBE_LENGTH;
    default:
      return -1;
  }
}

/* Payload bytes of a message to the host, or -1 if there is no such message. */
static inline int16_t message_length_to_host(uint8_t id) {
  switch (id) {
    case MSG_HELLO_ID:
      return MSG_HELLO_LENGTH;
    case MSG_IDENTITY_ID:
      return MSG_IDENTITY_LENGTH;
    case MSG_DESCRIPTION_ID:
      return MSG_DESCRIPTION_LENGTH;
    case MSG_STOPPED_ID:
      return MSG_STOPPED_LENGTH;
    case MSG_TELEMETRY_ID:
      return MSG_TELEMETRY_LENGTH;
    case MSG_COUNTERS_ID:
      return MSG_COUNTERS_LENGTH;
    case MSG_DEVICES_TELEMETRY_ID:
      return MSG_DEVICES_TELEMETRY_LENGTH;
    case MSG_TASK_TIME_ID:
      return MSG_TASK_TIME_LENGTH;
    case MSG_ANSWER_ID:
      return MSG_ANSWER_LENGTH;
    case MSG_EVENT_ID:
      return MSG_EVENT_LENGTH;
    case MSG_CLOCK_ANSWER_ID:
      return MSG_CLOCK_ANSWER_LENGTH;
    default:
      return -1;
  }
}

/* Whether the message belongs to the handshake, whose checksums start from the constant seed. */
static inline bool message_is_handshake(uint8_t id) {
  switch (id) {
    case MSG_OPEN_ID:
    case MSG_IDENTIFY_ID:
    case MSG_DESCRIBE_ID:
    case MSG_HELLO_ID:
    case MSG_IDENTITY_ID:
    case MSG_DESCRIPTION_ID:
      return true;
    default:
      return false;
  }
}

/* X(id, payload bytes, hash) for each message, in order of ids. */
#define MESSAGE_COUNT 28u
#define MESSAGE_LIST(X)     \
  X(0x01, 9, 0xE0471814ul)  \
  X(0x02, 0, 0xBD434780ul)  \
  X(0x03, 5, 0xDDE1C4B0ul)  \
  X(0x08, 1, 0xF533989Aul)  \
  X(0x09, 4, 0x0C4FA8AAul)  \
  X(0x10, 8, 0xEFBA28FDul)  \
  X(0x11, 8, 0xFCEB8D85ul)  \
  X(0x12, 4, 0xD86ACD27ul)  \
  X(0x18, 3, 0x76F31EB3ul)  \
  X(0x19, 4, 0xB81D6D3Ful)  \
  X(0x21, 7, 0x885FEFDBul)  \
  X(0x22, 2, 0x1DEAD58Cul)  \
  X(0x23, 2, 0x5C7C21EEul)  \
  X(0x24, 3, 0x7A25B50Eul)  \
  X(0x25, 3, 0xEE5C19C7ul)  \
  X(0x28, 2, 0x306E772Cul)  \
  X(0x30, 2, 0x1011476Bul)  \
  X(0x80, 44, 0xECA6681Bul) \
  X(0x81, 60, 0xF379E8B5ul) \
  X(0x82, 8, 0xACE09C27ul)  \
  X(0x88, 1, 0x24E076A5ul)  \
  X(0x90, 39, 0x421C7CB9ul) \
  X(0x91, 22, 0x87F975A3ul) \
  X(0x92, 31, 0xA1006857ul) \
  X(0x93, 3, 0x9EADF1CFul)  \
  X(0xA0, 7, 0x90997173ul)  \
  X(0xA1, 9, 0x515D19B5ul)  \
  X(0xB0, 6, 0xFC092B76ul)

#endif
