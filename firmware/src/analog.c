/* analog.c: see analog.h. */
#include "analog.h"

#include "clock.h"
#include "generated/values.h"
#include "hal/hal.h"
#include "parameters.h"
#include "tasks.h"

#define SETTLE_CYCLES (200u * HAL_CYCLES_PER_US) /* bandgap 70 us, and the sampling capacitor (24.6, 28.8) */
#define FIRST_ANALOG_PIN 14u

#ifdef PIN_BATTERY
#define BATTERY_CHANNEL (PIN_BATTERY - FIRST_ANALOG_PIN)
#else
#define BATTERY_CHANNEL 0u /* never on */
#endif
#ifdef PIN_ANALOG_INFRARED
#define INFRARED_CHANNEL (PIN_ANALOG_INFRARED - FIRST_ANALOG_PIN)
#else
#define INFRARED_CHANNEL 0u
#endif

static uint16_t results[ANALOG_INPUTS];
static uint8_t ages[ANALOG_INPUTS]; /* ticks */
static uint8_t input;               /* that the converter measures */
static uint8_t last_device;         /* the input before the bandgap */
static bool converting;
static bool tick_begins;     /* and the ages are still to grow by it */
static uint16_t selected_at; /* hal_time() */

static uint16_t now(void) {
  uint16_t time = 0;
  HAL_ATOMIC { time = hal_time(); }
  return time;
}

static void select_input(uint8_t next) {
  input = next;
  converting = false;
  selected_at = now();
  hal_analog_select(next == ANALOG_BATTERY    ? BATTERY_CHANNEL
                    : next == ANALOG_INFRARED ? INFRARED_CHANNEL
                                              : HAL_ANALOG_BANDGAP);
}

static bool is_on(uint8_t device) {
  return parameters_device_on(device == ANALOG_BATTERY ? DEVICES_BATTERY : DEVICES_ANALOG_INFRARED);
}

/* The bandgap every other time, between them the devices in turn. */
static uint8_t next_input(void) {
  const bool battery = is_on(ANALOG_BATTERY);
  const bool infrared = is_on(ANALOG_INFRARED);
  if (input != ANALOG_BANDGAP || (!battery && !infrared)) {
    return ANALOG_BANDGAP;
  }
  last_device = battery && (last_device != ANALOG_BATTERY || !infrared) ? ANALOG_BATTERY : ANALOG_INFRARED;
  return last_device;
}

void analog_connect(uint8_t device, bool connected) {
#ifdef PIN_BATTERY
  if (device == ANALOG_BATTERY && connected) {
    HAL_PIN_INPUT(BATTERY);
  } else if (device == ANALOG_BATTERY) {
    HAL_PIN_PULL_UP(BATTERY);
  }
#endif
#ifdef PIN_ANALOG_INFRARED
  if (device == ANALOG_INFRARED && connected) {
    HAL_PIN_INPUT(ANALOG_INFRARED);
  } else if (device == ANALOG_INFRARED) {
    HAL_PIN_PULL_UP(ANALOG_INFRARED);
  }
#endif
  (void)device, (void)connected;
}

void analog_start(void) {
  for (uint8_t i = 0; i < ANALOG_INPUTS; i++) {
    results[i] = 0;
    ages[i] = AGE_NEVER;
  }
  last_device = ANALOG_INFRARED;
  tick_begins = false;
  select_input(ANALOG_BANDGAP);
}

static void grow_older(uint8_t device) {
  analog_connect(device, is_on(device));
  if (!is_on(device)) {
    ages[device] = AGE_NEVER;
    results[device] = 0;
  } else {
    clock_grow_older(&ages[device]);
  }
}

/* Reads the converter's result, or does all else: no slot does both, which keeps the task short. */
void analog_task(void) {
  if (clock_tick_begins()) {
    tick_begins = true;
  }
  if (converting && !hal_analog_busy()) {
    results[input] = hal_analog_result();
    ages[input] = 0;
    select_input(next_input());
    return;
  }
  if (tick_begins) {
    tick_begins = false;
    grow_older(ANALOG_BATTERY);
    grow_older(ANALOG_INFRARED);
  }
  if (!converting && (uint16_t)(now() - selected_at) >= SETTLE_CYCLES) {
    converting = true;
    hal_analog_convert();
  }
}

uint16_t analog_read(uint8_t of) { return results[of]; }

uint8_t analog_age(uint8_t of) { return ages[of]; }

uint16_t analog_take_bandgap(void) {
  const uint16_t result = results[ANALOG_BANDGAP];
  results[ANALOG_BANDGAP] = 0;
  return result;
}
