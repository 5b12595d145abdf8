/* chip.c: the microcontroller as an event queue. Each source of interrupts has the cycle of its next event; the
 * earliest comes first, the firmware's interrupt runs at that cycle, and then its main loop if the event would have
 * woken it with something to do. Between events nothing happens, so nothing is spent. */
#include "firmware.h"
#include "generated/values.h"
#include "hal/hal.h"
#include "hal/interrupts.h"
#include "hal/native/events.h"
#include "pins.h"
#include "schedule.h"

static uint8_t reset_cause;

/* ---- the rest of hal.h ---- */

uint8_t hal_reset_cause(void) { return reset_cause; }

void hal_start_watchdog(void) {}
void hal_kick_watchdog(void) {}
void hal_watchdog_reset(void) {}

uint32_t hal_image_size(void) { return 0; }

uint32_t hal_image_hash(void) { return 0; }

/* ---- the event queue ---- */

static void poll_firmware(void) {
  do {
    firmware_poll();
  } while (firmware_due());
}

static void begin(uint8_t cause) {
  reset_cause = cause;
  while (native->next_edge <= native->now) { /* who drives a pin from the power-on does so before the program looks */
    const uint8_t pin = native->next_edge_pin;
    native->outside[pin] = native_take_edge(native).level;
  }
  for (int event = 0; event < EVENTS; event++) {
    native_next[event] = NATIVE_NEVER;
  }
  native_capture_reset();
  native_serial_reset();
  native_memory_reset();
  native_devices_reset();
  native_two_wire_reset();
  native_pins_reset();
  firmware_start();
  poll_firmware();
}

/* The earliest event. */
static native_event next_event(void) {
  native_next[EVENT_PIN] = native->next_edge;
  native_next[EVENT_BYTE] = native->next_byte;
  native_event earliest = EVENT_PIN;
  for (native_event event = EVENT_BYTE; event < EVENTS; event++) {
    if (native_next[event] < native_next[earliest]) {
      earliest = event;
    }
  }
  return earliest;
}

/* After an interrupt that may have given the main loop something to do. */
static void poll_if_due(void) {
  if (firmware_due()) {
    poll_firmware();
  }
}

static void run_event(native_event event) {
  switch (event) {
    case EVENT_PIN: {
      const uint8_t pin = native->next_edge_pin;
      native->outside[pin] = native_take_edge(native).level;
      native_settle(pin);
      poll_if_due();
      break;
    }
    case EVENT_BYTE:
      native_byte_arrived();
      poll_firmware();
      break;
    case EVENT_CARRIER:
      native_carrier_toggle();
      break;
    case EVENT_EDGE:
      native_next[EVENT_EDGE] = NATIVE_NEVER;
      native->interrupts++;
      servo_on_edge();
      break;
    case EVENT_SLOT:
      native->interrupts++;
      schedule_on_slot();
      poll_firmware();
      break;
    case EVENT_ROOM:
      native_next[EVENT_ROOM] = NATIVE_NEVER;
      poll_firmware();
      break;
    case EVENT_CONVERSION:
      native_conversion_done();
      break;
    case EVENT_EEPROM:
      native_eeprom_event();
      poll_if_due();
      break;
    case EVENT_TONE:
      native_tone_toggle();
      break;
    default: /* EVENT_TWO_WIRE */
      native_two_wire_step();
      break;
  }
}

static void run(uint64_t until) {
  while (!native->stop) {
    const native_event event = next_event();
    const uint64_t next = native_next[event];
    if (next > until) {
      break;
    }
    if (next > native->now) {
      native->now = next;
    }
    run_event(event);
  }
  if (native->now < until && !native->stop) {
    native->now = until;
  }
}

/* ---- the machine's owner ---- */

static void start(native_machine *owner, uint8_t cause) {
  native = owner;
  begin(cause);
}

NATIVE_EXPORT const native_api *firmware_board_api(void);
const native_api *firmware_board_api(void) {
  static const native_api api = {NATIVE_API_VERSION, PIN_MAP_NAME, start, run};
  return &api;
}
