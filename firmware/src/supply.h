/* supply.h: the supply voltage, measured once a tick against the chip's bandgap (data sheet of the ATmega328P, 24.9), and
 * whether it is too low for motors and EEPROM. */
#ifndef SUPPLY_H
#define SUPPLY_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"

void supply_start(void);

/* mV; 0: not yet measured. */
uint16_t supply_voltage(void);

/* Fills in its field of telemetry, and that of devices_telemetry; there false: its field alone is no reason to send the
 * message. */
void supply_report_telemetry(msg_telemetry *message);
bool supply_report_devices_telemetry(msg_devices_telemetry *message);

/* Two measurements in a row were below the parameter supply_minimum, and none since was 100 mV above it. */
bool supply_low(void);

#endif
