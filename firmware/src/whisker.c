/* whisker.c: see whisker.h. */
#include "whisker.h"

#include "events.h"
#include "generated/values.h"
#include "hal/hal.h"
#include "parameters.h"
#include "tasks.h"

#define PRESSED_SAMPLES 2u
#define RELEASED_SAMPLES 4u

bool whisker_debounce(whisker_state *state, bool touching) {
  if (touching == state->pressed) {
    state->streak = 0;
    return state->pressed;
  }
  state->streak++;
  if (state->streak >= (touching ? PRESSED_SAMPLES : RELEASED_SAMPLES)) {
    state->pressed = touching;
    state->streak = 0;
  }
  return state->pressed;
}

static whisker_state states[SIDES];

void whisker_start(void) {
#ifdef PIN_WHISKER_LEFT
  HAL_PIN_PULL_UP(WHISKER_LEFT);
  HAL_PIN_PULL_UP(WHISKER_RIGHT);
#endif
  states[LEFT] = states[RIGHT] = (whisker_state){0};
}

void whisker_task(void) {
  const uint8_t before = whisker_read();
#ifdef PIN_WHISKER_LEFT
  whisker_debounce(&states[LEFT], HAL_PIN_READ(WHISKER_LEFT) == 0);
  whisker_debounce(&states[RIGHT], HAL_PIN_READ(WHISKER_RIGHT) == 0);
#endif
  const uint8_t now = whisker_read();
  if (now != before) {
    const uint8_t closed = now & (uint8_t)~before;
    events_raise(EVENT_KIND_WHISKERS, (uint16_t)(now | closed << 8));
  }
}

uint8_t whisker_read(void) {
  if (!parameters_device_on(DEVICES_WHISKER)) {
    return 0;
  }
  return (uint8_t)((states[LEFT].pressed ? WHISKERS_LEFT : 0u) | (states[RIGHT].pressed ? WHISKERS_RIGHT : 0u));
}

void whisker_report_telemetry(msg_telemetry *message) { message->whiskers = whisker_read(); }
