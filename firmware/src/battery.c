/* battery.c: see battery.h. */
#include "battery.h"

#include "analog.h"
#include "generated/values.h"
#include "parameters.h"

void battery_start(void) { analog_connect(ANALOG_BATTERY, false); }

bool battery_report_devices_telemetry(msg_devices_telemetry *message) {
  message->battery = analog_read(ANALOG_BATTERY);
  message->battery_age = analog_age(ANALOG_BATTERY);
  return parameters_device_on(DEVICES_BATTERY);
}
