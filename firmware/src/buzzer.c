/* buzzer.c: see buzzer.h. */
#include "buzzer.h"

#include "division.h"
#include "generated/messages.h"
#include "hal/hal.h"
#include "link/parameters.h"
#include "pins.h"

#define START_FREQUENCY 2000u /* Hz */

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

/* Sounds the tone in a clock of half_rate * 2^(places + 1) Hz: half a period is clock / (2 * frequency) of its counts, rounded
 * down. */
static void sound_by(uint8_t clock, uint16_t half_rate, uint8_t places, uint16_t frequency) {
  hal_tone_start(clock, (uint8_t)divide(half_rate, frequency, places));
}

/* The fastest clock in which half a period is 255 counts at most. */
static void sound(uint16_t frequency) {
  if (frequency > 3906u) {
    sound_by(HAL_TONE_BY_8, 62500u, 4, frequency); /* 2 MHz */
  } else if (frequency > 488u) {
    sound_by(HAL_TONE_BY_64, 62500u, 1, frequency); /* 250 kHz */
  } else if (frequency > 122u) {
    sound_by(HAL_TONE_BY_256, 31250u, 0, frequency);
  } else {
    sound_by(HAL_TONE_BY_1024, 7812u, 0, frequency);
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
