/* buzzer.c: see buzzer.h. */
#include "buzzer.h"

#include "generated/values.h"
#include "hal/hal.h"
#include "parameters.h"
#include "tasks.h"

#define START_FREQUENCY 2000u /* Hz */

static uint8_t left;      /* ticks of the tone still to come */
static uint8_t token;     /* of the last tone */
static bool is_start;     /* it is the tone at start */
static bool is_connected; /* the board drives the pin */

void buzzer_start(void) {
  HAL_PIN_PULL_UP(BUZZER);
  is_connected = false;
  left = 0;
  token = 0;
  is_start = false;
}

static void connect(bool connected) {
  if (connected == is_connected) {
    return;
  }
  is_connected = connected;
  if (connected) {
    HAL_PIN_OUTPUT_LOW(BUZZER);
  } else {
    HAL_PIN_PULL_UP(BUZZER);
  }
}

#define RATE(divisor) (16000000ul / (divisor))                            /* of the tone's clock, Hz */
#define LOWEST(divisor) ((uint16_t)(RATE(divisor) / (2ul * 256ul) + 1ul)) /* Hz: half a period is 255 counts at most */

/* The fastest clock that can be counted in 8 bits. */
static void sound(uint16_t frequency) {
  uint8_t clock = HAL_TONE_BY_8;
  uint32_t rate = RATE(8);
  if (frequency < LOWEST(256)) {
    clock = HAL_TONE_BY_1024;
    rate = RATE(1024);
  } else if (frequency < LOWEST(64)) {
    clock = HAL_TONE_BY_256;
    rate = RATE(256);
  } else if (frequency < LOWEST(8)) {
    clock = HAL_TONE_BY_64;
    rate = RATE(64);
  }
  connect(true);
  hal_tone_start(clock, (uint8_t)(rate / (2ul * frequency)));
}

static void end(void) {
  if (left != 0) {
    hal_tone_stop();
  }
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
  if (!parameters_device_in_use(DEVICES_BUZZER) ||
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

/* Once per tick: ends what has sounded long enough. */
void buzzer_task(void) {
  if (left == 1 || !parameters_device_on(DEVICES_BUZZER)) {
    end();
  } else if (left != 0) {
    left--;
  }
  connect(left != 0 || parameters_device_in_use(DEVICES_BUZZER));
}

bool buzzer_report_devices_telemetry(msg_devices_telemetry *message) {
  message->buzzer_token = token;
  return parameters_device_on(DEVICES_BUZZER);
}
