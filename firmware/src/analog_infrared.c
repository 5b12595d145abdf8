/* analog_infrared.c: see analog_infrared.h. */
#include "analog_infrared.h"

#include "analog.h"
#include "generated/values.h"
#include "parameters.h"

void analog_infrared_start(void) { analog_connect(ANALOG_INFRARED, false); }

bool analog_infrared_report_devices_telemetry(msg_devices_telemetry *message) {
  message->analog_infrared = analog_read(ANALOG_INFRARED);
  message->analog_infrared_age = analog_age(ANALOG_INFRARED);
  return parameters_device_on(DEVICES_ANALOG_INFRARED);
}
