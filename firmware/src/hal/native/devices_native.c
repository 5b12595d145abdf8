/* devices_native.c: what the chip does for devices: IR carrier, tone, analog converter. */
#include "hal/hal.h"
#include "hal/interrupts.h"
#include "hal/native/events.h"

#define CONVERSION_CYCLES (104u * HAL_CYCLES_PER_US) /* 13 cycles of 125 kHz */
#define NOMINAL_VOLTS 5.0
#define BAND_GAP_VOLTS 1.1

static uint8_t carrier_side, carrier_pin, carrier_half_period, toggles_left;
static uint8_t receiver_high[SIDES]; /* at the end of its last burst */
static uint32_t tone_half_period;
static uint8_t analog_channel;
static uint16_t analog_result;

void native_devices_reset(void) {
  analog_channel = 0;
  analog_result = 0;
}

/* ---- IR carrier ---- */

void hal_burst_start(uint8_t side, uint8_t half_period, uint8_t toggles) {
  carrier_side = side;
  carrier_pin = side == LEFT ? PIN_INFRARED_LEFT_LED : PIN_INFRARED_RIGHT_LED;
  carrier_half_period = half_period;
  toggles_left = toggles;
  native_next[EVENT_CARRIER] = native->now + half_period;
}

bool hal_burst_seen(uint8_t side) { return receiver_high[side] == 0; }

void native_carrier_toggle(void) {
  native_next[EVENT_CARRIER] += carrier_half_period;
  native->interrupts++;
  hal_native_toggle(carrier_pin);
  toggles_left--;
  if (toggles_left == 0) {
    native_next[EVENT_CARRIER] = NATIVE_NEVER;
    receiver_high[carrier_side] =
        carrier_side == LEFT ? HAL_PIN_READ(INFRARED_LEFT_RECEIVER) : HAL_PIN_READ(INFRARED_RIGHT_RECEIVER);
  }
}

/* ---- buzzer ---- */

void hal_tone_start(uint8_t clock, uint8_t count) {
  static const uint16_t cycles[] = {
      [HAL_TONE_BY_8] = 8, [HAL_TONE_BY_64] = 64, [HAL_TONE_BY_256] = 256, [HAL_TONE_BY_1024] = 1024};
  tone_half_period = (uint32_t)count * cycles[clock];
  native_next[EVENT_TONE] = native->now + tone_half_period;
}

void hal_tone_stop(void) {
  native_next[EVENT_TONE] = NATIVE_NEVER;
  HAL_PIN_LOW(BUZZER);
}

void native_tone_toggle(void) {
  native_next[EVENT_TONE] += tone_half_period;
  native->interrupts++;
  HAL_PIN_TOGGLE(BUZZER);
}

/* ---- analog converter ---- */

void hal_analog_select(uint8_t channel) { analog_channel = channel; }

void hal_analog_convert(void) {
  if (!hal_analog_busy()) {
    native_next[EVENT_CONVERSION] = native->now + CONVERSION_CYCLES;
  }
}

bool hal_analog_busy(void) { return native_next[EVENT_CONVERSION] != NATIVE_NEVER; }

uint16_t hal_analog_result(void) { return analog_result; }

static double volts_at(uint8_t channel) { return native->analog(native, native->now, channel); }

void native_conversion_done(void) {
  const double supply = native->analog != NULL ? volts_at(NATIVE_SUPPLY) : NOMINAL_VOLTS;
  double volts = BAND_GAP_VOLTS;
  if (analog_channel != HAL_ANALOG_BANDGAP) {
    volts = native->analog != NULL ? volts_at(analog_channel) : 0.0;
  }
  const double steps = volts * 1024.0 / supply;
  native_next[EVENT_CONVERSION] = NATIVE_NEVER;
  analog_result = steps < 1023.0 ? (uint16_t)(steps > 0.0 ? steps : 0.0) : 1023u;
}
