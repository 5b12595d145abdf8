/* chip.c: the microcontroller as an event queue. Each source of interrupts has the cycle of its next event; the
 * earliest comes first, the firmware's interrupt runs at that cycle, and then its main loop if the event would have
 * woken it with something to do. Between events nothing happens, so nothing is spent. */
#include <string.h>

#include "firmware.h"
#include "generated/values.h"
#include "hal/hal.h"
#include "hal/interrupts.h"
#include "hal/native/events.h"
#include "pins.h"
#include "schedule.h"

uint8_t hal_native_port_b, hal_native_port_c, hal_native_port_d;

native_machine *native;
uint64_t native_next[EVENTS];
static uint8_t reset_cause;
static uint64_t epoch; /* cycle at which the timer read 0 */

static bool level_high[NATIVE_PINS]; /* PORT bits */
static bool is_output[NATIVE_PINS];  /* DDR bits */
static uint8_t port_c_bits;          /* port C */
static uint8_t port_d_bits;          /* port D */

/* ---- pins ---- */

static uint8_t *port_of(uint8_t pin) {
  return pin < 8 ? &hal_native_port_d : pin < 14 ? &hal_native_port_b : &hal_native_port_c;
}

static uint8_t bit_of(uint8_t pin) { return (uint8_t)(1u << (pin < 8 ? pin : pin < 14 ? pin - 8 : pin - 14)); }

#define CAPTURE_PIN 8u

/* Works out the level on a pin; interrupts if it has changed. */
static void settle(uint8_t pin) {
  uint8_t state = native->output[pin];
  if (state == NATIVE_RELEASED || state == NATIVE_PULLED_UP) {
    if (native->outside[pin] != NATIVE_RELEASED) {
      state = native->outside[pin];
    }
  }
  const bool high = state == NATIVE_HIGH || state == NATIVE_PULLED_UP;
  uint8_t *port = port_of(pin);
  const uint8_t bit = bit_of(pin);
  const bool was_high = (*port & bit) != 0;
  if (high == was_high) {
    return;
  }
  *port = (uint8_t)(*port ^ bit);
  if (port == &hal_native_port_c && (port_c_bits & bit) != 0) {
    native->interrupts++;
    pin_changes_on_change(hal_time(), PINC);
  }
  if (port == &hal_native_port_d && (port_d_bits & bit) != 0) {
    native->interrupts++;
    port_d_on_change(hal_time());
  }
  if (pin == CAPTURE_PIN) {
    native_capture_edge(high);
  }
}

/* Reports to the outside what the firmware now does to a pin. */
static void show(uint8_t pin) {
  const uint8_t state = is_output[pin] ? (level_high[pin] ? NATIVE_HIGH : NATIVE_LOW)
                                       : (level_high[pin] ? NATIVE_PULLED_UP : NATIVE_RELEASED);
  if (state != native->output[pin]) {
    native->output[pin] = state;
    native->edge(native, native->now, pin, state);
    settle(pin);
  }
}

void hal_native_direction(uint8_t pin, bool output) {
  is_output[pin] = output;
  show(pin);
}

void hal_native_write(uint8_t pin, bool high) {
  level_high[pin] = high;
  show(pin);
}

void native_pull(uint8_t pin, bool low) {
  is_output[pin] = low;
  level_high[pin] = !low;
  show(pin);
}

bool native_level(uint8_t pin) { return (*port_of(pin) & bit_of(pin)) != 0; }

void hal_native_toggle(uint8_t pin) { hal_native_write(pin, !level_high[pin]); }

void hal_watch_port_c(uint8_t bits) { port_c_bits = bits; }

void hal_watch_port_d(uint8_t bits) { port_d_bits = bits; }

/* ---- time ---- */

uint16_t hal_time(void) { return (uint16_t)(native->now - epoch); }

void hal_start_timers(void) {
  epoch = native->now;
  native_next[EVENT_SLOT] = epoch + HAL_SLOT_CYCLES;
}

/* The cycle at which the count will be `time` next. */
static uint64_t cycle_of(uint16_t time) {
  const uint16_t ahead = (uint16_t)(time - hal_time());
  return native->now + (ahead != 0 ? ahead : 65536u);
}

void hal_slot_arm(uint16_t time) { native_next[EVENT_SLOT] = cycle_of(time); }

void hal_edge_arm(uint16_t time) { native_next[EVENT_EDGE] = cycle_of(time); }

void hal_edge_disarm(void) { native_next[EVENT_EDGE] = NATIVE_NEVER; }

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
  hal_native_port_b = hal_native_port_c = hal_native_port_d = 0;
  for (int event = 0; event < EVENTS; event++) {
    native_next[event] = NATIVE_NEVER;
  }
  native_serial_reset();
  native_memory_reset();
  native_devices_reset();
  native_two_wire_reset();
  memset(level_high, 0, sizeof level_high);
  memset(is_output, 0, sizeof is_output);
  port_c_bits = port_d_bits = 0;
  for (uint8_t pin = 0; pin < NATIVE_PINS; pin++) {
    show(pin); /* a reset releases every pin */
    settle(pin);
  }
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

/* Bursts are three thousand edges a second: their own loop, until something else comes. */
static void run_carrier(uint64_t until) {
  const uint64_t start = native_next[EVENT_CARRIER];
  native_next[EVENT_CARRIER] = NATIVE_NEVER;
  const uint64_t other = native_next[next_event()];
  native_next[EVENT_CARRIER] = start;
  do {
    native->now = native_next[EVENT_CARRIER];
    native_carrier_toggle();
  } while (native_next[EVENT_CARRIER] <= until && native_next[EVENT_CARRIER] < other &&
           native_next[EVENT_CARRIER] < native->next_edge && !native->stop);
}

/* After an interrupt that may have given the main loop something to do. */
static void poll_if_due(void) {
  if (firmware_due()) {
    poll_firmware();
  }
}

static void run_event(native_event event, uint64_t until) {
  switch (event) {
    case EVENT_PIN: {
      const uint8_t pin = native->next_edge_pin;
      native->outside[pin] = native_take_edge(native).level;
      settle(pin);
      poll_if_due();
      break;
    }
    case EVENT_BYTE:
      native_byte_arrived();
      poll_firmware();
      break;
    case EVENT_CARRIER:
      run_carrier(until);
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
    run_event(event, until);
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
