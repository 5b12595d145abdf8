/* values.h: the flags and values that messages speak of, from protocol/messages.toml.
 * Made by protocol/generate.py; do not edit. */
#ifndef GENERATED_VALUES_H
#define GENERATED_VALUES_H

/* Whiskers, debounced: a set bit is a pressed whisker. */
#define WHISKERS_LEFT (1u << 0)
#define WHISKERS_RIGHT (1u << 1)

/* IR pairs at the last burst: a set bit is an object seen. */
#define INFRARED_LEFT (1u << 0)
#define INFRARED_RIGHT (1u << 1)

/* State and faults of the board. */
#define STATUS_MOTORS_ENABLED (1u << 0) /* a fresh set-point is in force */
#define STATUS_DEAD_MAN (1u << 1) /* the last set-point outlived its time to live; motors are stopped until the next */
#define STATUS_LATCHED (1u << 2) /* motors are stopped until armed again; `latch` says why */
#define STATUS_ENCODER_LEFT_MASKED (1u << 3) /* the line fired above its limit in the last tick and was masked until the tick ended */
#define STATUS_ENCODER_RIGHT_MASKED (1u << 4) /* the same on the right */
#define STATUS_TICK_OVERRUN (1u << 5) /* the previous tick's work did not end in time */
#define STATUS_RECEIVE_OVERRUN (1u << 6) /* the UART lost bytes since the last telemetry */
#define STATUS_WATCHDOG_RESET (1u << 7) /* this run began with a watchdog reset */
#define STATUS_SUPPLY_LOW (1u << 8) /* the supply is below supply_minimum now */
#define STATUS_SAVING (1u << 9) /* the EEPROM is being written */
#define STATUS_FALLBACK (1u << 10) /* the board's own brain drives */

/* Devices switched on. */
#define DEVICES_SERVO (1u << 0)
#define DEVICES_ENCODER (1u << 1)
#define DEVICES_WHISKER (1u << 2)
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
  RESET_CAUSE_POWER = 1, /* the power came */
  RESET_CAUSE_EXTERNAL = 2, /* the reset button or line. Behind a bootloader that takes the chip's own answer, as Optiboot does, memory tells the cause; then a reset by the watchdog whose interrupt was off, and a brown-out so short that memory stayed whole, look like this one */
  RESET_CAUSE_BROWN_OUT = 3, /* the supply was too low */
  RESET_CAUSE_WATCHDOG = 4, /* the program hung, outside of the tasks; or, below, in a task */
  RESET_CAUSE_WATCHDOG_IN_WHISKER = 5,
  RESET_CAUSE_WATCHDOG_IN_SAFETY = 6,
  RESET_CAUSE_WATCHDOG_IN_ANALOG = 7,
  RESET_CAUSE_WATCHDOG_IN_LIGHT = 8,
  RESET_CAUSE_WATCHDOG_IN_EVENTS = 9,
  RESET_CAUSE_WATCHDOG_IN_ENCODER = 10,
  RESET_CAUSE_WATCHDOG_IN_INFRARED = 11,
  RESET_CAUSE_WATCHDOG_IN_PING_ECHO = 12,
  RESET_CAUSE_WATCHDOG_IN_PING = 13,
  RESET_CAUSE_WATCHDOG_IN_TELEMETRY = 14,
  RESET_CAUSE_WATCHDOG_IN_REQUESTS = 15,
  RESET_CAUSE_WATCHDOG_IN_SESSION = 16,
  RESET_CAUSE_WATCHDOG_IN_SUPPLY = 17,
  RESET_CAUSE_WATCHDOG_IN_COUNTERS = 18,
  RESET_CAUSE_WATCHDOG_IN_STORAGE = 19,
  RESET_CAUSE_WATCHDOG_IN_TURRET = 20,
  RESET_CAUSE_WATCHDOG_IN_BUZZER = 21,
  RESET_CAUSE_WATCHDOG_IN_COMPASS = 22,
  RESET_CAUSE_WATCHDOG_IN_DEVICES = 23,
  RESET_CAUSE_WATCHDOG_IN_FALLBACK = 24,
  RESET_CAUSE_COUNT
};

/* The tasks of the firmware, from firmware/src/tasks.def. */
enum {
  TASK_WHISKER = 0,
  TASK_SAFETY = 1,
  TASK_ANALOG = 2,
  TASK_LIGHT = 3,
  TASK_EVENTS = 4,
  TASK_ENCODER = 5,
  TASK_INFRARED = 6,
  TASK_PING_ECHO = 7,
  TASK_PING = 8,
  TASK_TELEMETRY = 9,
  TASK_REQUESTS = 10,
  TASK_SESSION = 11,
  TASK_SUPPLY = 12,
  TASK_COUNTERS = 13,
  TASK_STORAGE = 14,
  TASK_TURRET = 15,
  TASK_BUZZER = 16,
  TASK_COMPASS = 17,
  TASK_DEVICES = 18,
  TASK_FALLBACK = 19,
  TASK_COUNT
};

/* Why the motors are latched off. */
enum {
  LATCH_NONE = 0,
  LATCH_START = 1,
  LATCH_STOP_COMMAND = 2,
  LATCH_SESSION_ENDED = 3,
  LATCH_SUPPLY_LOW = 4,
  LATCH_COUNT
};

/* How a numbered request ended. */
enum {
  ANSWER_STATUS_OK = 0,
  ANSWER_STATUS_UNKNOWN_PARAMETER = 1, /* there is none of that number */
  ANSWER_STATUS_OUT_OF_RANGE = 2, /* outside the parameter's range */
  ANSWER_STATUS_SUPPLY_LOW = 3, /* arm: the supply is low, or not yet measured (then `supply` in telemetry is 0: ask again in a tick); save_parameters: it is low */
  ANSWER_STATUS_STORAGE_FAILED = 4, /* what was written to the EEPROM does not read back */
  ANSWER_STATUS_LATCHED_AGAIN = 5, /* arm: the motors have been latched off since; see `latches` in telemetry */
  ANSWER_STATUS_BUSY = 6, /* the EEPROM is being written: ask again later */
  ANSWER_STATUS_COUNT
};

/* What the Ping's last measurement was. */
enum {
  PING_STATUS_OFF = 0, /* switched off, or not yet measured */
  PING_STATUS_OK = 1, /* an echo was measured */
  PING_STATUS_NOTHING_NEAR = 2, /* the sensor answered, but heard no echo */
  PING_STATUS_ABSENT = 3, /* no rising edge after the trigger, or a pulse that does not end: no sensor, or its wire is broken */
  PING_STATUS_TOO_NEAR = 4, /* the echo was too short to be stamped */
  PING_STATUS_COUNT
};

/* How the last exchange with the compass ended. */
enum {
  COMPASS_STATUS_OFF = 0, /* switched off, or not yet begun */
  COMPASS_STATUS_OK = 1, /* its reading is in x, y, z */
  COMPASS_STATUS_NO_ANSWER = 2, /* no device answers at its address; tried again */
  COMPASS_STATUS_BUS_STUCK = 3, /* the bus did not come to an end in time; it is being freed */
  COMPASS_STATUS_FAILED = 4, /* the exchange broke off: arbitration lost, bus error, byte refused; tried again */
  COMPASS_STATUS_COUNT
};

/* What happened, and what `value` is. */
enum {
  EVENT_KIND_WHISKERS = 0, /* a whisker closed or opened: low byte, the whiskers flags from now on; high byte, those that closed since the last event */
  EVENT_KIND_LATCH = 1, /* the motors were latched off or armed: the latch from now on, none where they were armed */
  EVENT_KIND_DEAD_MAN = 2, /* a set-point outlived its time to live, the motors stopped: low 16 bits of the tick that it answered */
  EVENT_KIND_FALLBACK = 3, /* 1: the board's own brain took over; 0: it drives no more: it handed back, or was stopped */
  EVENT_KIND_COUNT
};

#endif
