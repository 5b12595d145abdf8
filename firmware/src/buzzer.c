/* buzzer.c: see buzzer.h. */
#include "buzzer.h"

#include "bounds.h"
#include "generated/messages.h"
#include "hal/hal.h"
#include "link/parameters.h"
#include "pins.h"

#define START_FREQUENCY 2000u /* Hz */
#define STEPS_MAX 4u          /* of a division; the finest clock's */

static uint8_t left;  /* ticks of the tone still to come */
static uint8_t token; /* of the last tone */
static bool is_start; /* it is the tone at start */

void buzzer_start(void) {
  HAL_PIN_LOW(BUZZER);
  HAL_PIN_OUTPUT(BUZZER);
  hal_tone_stop();
  HAL_ZERO(left);
  HAL_ZERO(token);
  HAL_ZERO(is_start);
}

/* Half a period in counts of a clock, clock / (2 * frequency), rounded down: a division of 16 bits and `steps` of a longer
 * one by hand, as in supply.c. clock / 2 = half_rate * 2^steps. */
static uint8_t half_period(uint16_t half_rate, uint8_t steps, uint16_t frequency) {
  uint16_t quotient = half_rate / frequency;
  uint16_t rest = half_rate % frequency;
  BOUNDED(STEPS_MAX, for (; steps > 0; steps--)) {
    quotient = (uint16_t)(quotient << 1);
    rest = (uint16_t)(rest << 1);
    if (rest >= frequency) {
      rest = (uint16_t)(rest - frequency);
      quotient++;
    }
  }
  return (uint8_t)quotient;
}

/* The fastest clock in which half a period is 255 counts at most. */
static void sound(uint16_t frequency) {
  if (frequency > 3906u) {
    hal_tone_start(HAL_TONE_BY_8, half_period(62500u, STEPS_MAX, frequency)); /* 1 MHz */
  } else if (frequency > 488u) {
    hal_tone_start(HAL_TONE_BY_64, half_period(62500u, 1, frequency)); /* 125 kHz */
  } else if (frequency > 122u) {
    hal_tone_start(HAL_TONE_BY_256, half_period(31250u, 0, frequency));
  } else {
    hal_tone_start(HAL_TONE_BY_1024, half_period(7812u, 0, frequency));
  }
}

static void end(void) {
  hal_tone_stop();
  left = 0;
  is_start = false;
}

void buzzer_start_beep(void) {
  const uint8_t ticks = (uint8_t)parameters_u16(PARAMETER_START_BEEP);
  if (ticks != 0 && parameters_device_on(DEVICES_BUZZER)) {
    left = ticks;
    is_start = true;
    sound(START_FREQUENCY);
  }
}

void buzzer_start_session(void) { token = 0; }

bool buzzer_tone(uint16_t frequency, uint8_t ticks, uint8_t new_token) {
  if (!parameters_device_on(DEVICES_BUZZER) ||
      (frequency != 0 && (frequency < BUZZER_FREQUENCY_MIN || frequency > BUZZER_FREQUENCY_MAX))) {
    return false;
  }
  if (new_token == token) {
    return true;
  }
  token = new_token;
  end();
  if (frequency != 0 && ticks != 0) {
    left = ticks;
    sound(frequency);
  }
  return true;
}

void buzzer_silence(void) {
  if (!is_start) {
    end();
  }
}

void buzzer_task(void) {
  if (left != 0 && (--left == 0 || !parameters_device_on(DEVICES_BUZZER))) {
    end();
  }
}

uint8_t buzzer_token(void) { return token; }
