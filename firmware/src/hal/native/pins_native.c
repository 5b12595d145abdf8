/* pins_native.c: what the firmware and the outside do to the pins, and the levels that come of it. */
#include <string.h>

#include "hal/hal.h"
#include "hal/interrupts.h"
#include "hal/native/events.h"

uint8_t hal_native_port_b, hal_native_port_c, hal_native_port_d;

static bool level_high[NATIVE_PINS]; /* PORT bits */
static bool is_output[NATIVE_PINS];  /* DDR bits */
static uint8_t port_c_bits, port_d_bits;

static uint8_t *port_of(uint8_t pin) {
  return pin < 8 ? &hal_native_port_d : pin < 14 ? &hal_native_port_b : &hal_native_port_c;
}

static uint8_t bit_of(uint8_t pin) { return (uint8_t)(1u << (pin < 8 ? pin : pin < 14 ? pin - 8 : pin - 14)); }

#define CAPTURE_PIN 8u

/* Works out the level on a pin; interrupts if it has changed. */
void native_settle(uint8_t pin) {
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
    native_settle(pin);
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

void native_pins_reset(void) {
  hal_native_port_b = hal_native_port_c = hal_native_port_d = 0;
  memset(level_high, 0, sizeof level_high);
  memset(is_output, 0, sizeof is_output);
  port_c_bits = port_d_bits = 0;
  for (uint8_t pin = 0; pin < NATIVE_PINS; pin++) {
    show(pin);
    native_settle(pin);
  }
}
