/* devices.h: the devices of this image, from protocol/messages.toml and the pin map.
 * Made by protocol/generate.py; do not edit. */
#ifndef GENERATED_DEVICES_H
#define GENERATED_DEVICES_H

#include "analog_infrared.h"
#include "battery.h"
#include "buzzer.h"
#include "compass.h"
#include "encoder.h"
#include "infrared.h"
#include "light.h"
#include "ping.h"
#include "servo.h"
#include "supply.h"
#include "turret.h"
#include "whisker.h"
#include "clock.h"
#include "generated/messages.h"
#include "link/send.h"
#include "pins.h"

#define BUILDS_TELEMETRY ((DEVICES_BUILT & (DEVICES_ENCODER | DEVICES_WHISKER | DEVICES_INFRARED | DEVICES_PING | DEVICES_SERVO)) != 0)
#define BUILDS_DEVICES_TELEMETRY ((DEVICES_BUILT & (DEVICES_INFRARED | DEVICES_BATTERY | DEVICES_ANALOG_INFRARED | DEVICES_LIGHT | DEVICES_COMPASS | DEVICES_TURRET | DEVICES_BUZZER)) != 0)

/* All of them, before anything is known of the parameters. */
static inline void devices_start(void) {
#if BUILDS_TELEMETRY
  servo_start();
#endif
#if BUILDS_TELEMETRY
  encoder_start();
#endif
#if BUILDS_TELEMETRY
  whisker_start();
#endif
#if BUILDS_TELEMETRY || BUILDS_DEVICES_TELEMETRY
  infrared_start();
#endif
#if BUILDS_TELEMETRY
  ping_start();
#endif
#if BUILDS_DEVICES_TELEMETRY
  battery_start();
#endif
#if BUILDS_DEVICES_TELEMETRY
  light_start();
#endif
#if BUILDS_DEVICES_TELEMETRY
  analog_infrared_start();
#endif
#if BUILDS_DEVICES_TELEMETRY
  compass_start();
#endif
#if BUILDS_DEVICES_TELEMETRY
  turret_start();
#endif
#if BUILDS_DEVICES_TELEMETRY
  buzzer_start();
#endif
}

static inline void devices_report_telemetry(msg_telemetry *message) {
  encoder_report_telemetry(message);
  whisker_report_telemetry(message);
  infrared_report_telemetry(message);
  ping_report_telemetry(message);
  servo_report_telemetry(message);
  supply_report_telemetry(message);
}

#if BUILDS_DEVICES_TELEMETRY
static inline bool devices_report_devices_telemetry(msg_devices_telemetry *message) {
  bool any = false;
  any |= supply_report_devices_telemetry(message);
  any |= infrared_report_devices_telemetry(message);
  any |= battery_report_devices_telemetry(message);
  any |= analog_infrared_report_devices_telemetry(message);
  any |= light_report_devices_telemetry(message);
  any |= compass_report_devices_telemetry(message);
  any |= turret_report_devices_telemetry(message);
  any |= buzzer_report_devices_telemetry(message);
  return any;
}
#endif

/* Messages of devices besides telemetry: how many there are, */
#define DEVICE_MESSAGES 1u

/* how long the payload of one is, */
static inline uint8_t device_message_length(uint8_t number) {
  switch (number) {
#if BUILDS_DEVICES_TELEMETRY
    case 0: {
      return MSG_DEVICES_TELEMETRY_LENGTH;
    }
#endif
    default:
      return 0;
  }
}

/* and sends it, if one of its devices has something to say. */
static inline bool device_message_send(uint8_t number) {
  switch (number) {
#if BUILDS_DEVICES_TELEMETRY
    case 0: {
      msg_devices_telemetry message = {.tick = clock_tick()};
      return devices_report_devices_telemetry(&message) && send_message(MSG_DEVICES_TELEMETRY_ID, &message, sizeof message);
    }
#endif
    default:
      return false;
  }
}

#endif
