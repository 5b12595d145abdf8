/* devices.c: see devices.h. */
#include "link/devices.h"

#include <stdbool.h>

#include "analog.h"
#include "buzzer.h"
#include "clock.h"
#include "compass.h"
#include "generated/messages.h"
#include "infrared.h"
#include "light.h"
#include "link/frame.h"
#include "link/receive.h"
#include "link/send.h"
#include "link/session_seed.h"
#include "parameters.h"
#include "pins.h"
#include "servo.h"
#include "supply.h"
#include "tasks.h"

#define LINE_SHARE 4u /* it fills a quarter of the line at most */
#define DEVICES \
  (DEVICES_BATTERY | DEVICES_LIGHT | DEVICES_ANALOG_INFRARED | DEVICES_COMPASS | DEVICES_TURRET | DEVICES_BUZZER)

static uint8_t line_period; /* ticks */
static uint8_t since;       /* ticks, saturating */

void devices_start_line(void) {
  line_period = send_ticks(LINE_SHARE * (MSG_DEVICES_TELEMETRY_LENGTH + FRAME_OVERHEAD));
  since = 0;
}

static bool any_on(void) {
  return parameters_device_on(DEVICES) ||
         (parameters_device_on(DEVICES_INFRARED) && parameters_u16(PARAMETER_INFRARED_SWEEP) != 0);
}

/* In every tick: sends it when it is its turn, in a session, while one of the devices is on, if no message from the host
 * waits for room for its answer and the next telemetry has room after it. */
void devices_task(void) {
  if (since < UINT8_MAX) {
    since++;
  }
  /* Neither must it take the room that a message waits for, nor that of the next telemetry. */
  if (!session_is_open() || receive_room != 0 || since < line_period ||
      since < parameters_u16(PARAMETER_DEVICES_PERIOD) || !any_on() || !send_has_room(MSG_DEVICES_TELEMETRY_LENGTH)) {
    return;
  }
  since = 0;
  const compass_reading *compass = compass_read();
  const msg_devices_telemetry message = {
      .tick = clock_tick(),
      .supply = supply_voltage(),
      .infrared_zone_left = infrared_zone(LEFT),
      .infrared_zone_right = infrared_zone(RIGHT),
      .infrared_zone_age = infrared_zone_age(),
      .battery = analog_read(ANALOG_BATTERY),
      .battery_age = analog_age(ANALOG_BATTERY),
      .analog_infrared = analog_read(ANALOG_INFRARED),
      .analog_infrared_age = analog_age(ANALOG_INFRARED),
      .light_left = light_read(LEFT),
      .light_right = light_read(RIGHT),
      .light_age = light_age(),
      .compass_x = compass->x,
      .compass_y = compass->y,
      .compass_z = compass->z,
      .compass_age = compass->age,
      .compass_status = compass->status,
      .turret_pulse = servo_pulse(SERVO_TURRET),
      .buzzer_token = buzzer_token(),
  };
  send_message(MSG_DEVICES_TELEMETRY_ID, &message, sizeof message);
}
