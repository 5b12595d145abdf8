/* clock_native.c: Timer1 as events: the count, its compares, the capture of edges. */
#include "hal/hal.h"
#include "hal/interrupts.h"
#include "hal/native/events.h"

native_machine *native;
uint64_t native_next[EVENTS];
static uint64_t epoch; /* cycle at which the timer read 0 */
static enum { CAPTURE_OFF, CAPTURE_RISING, CAPTURE_FALLING } capture;

uint16_t hal_time(void) { return (uint16_t)(native->now - epoch); }

void hal_start_timers(void) {
  epoch = native->now;
  native_next[EVENT_SLOT] = epoch + HAL_SLOT_CYCLES;
}

void hal_wait(uint16_t cycles) { native->now += cycles; }

/* The cycle at which the count will be `time` next. */
static uint64_t cycle_of(uint16_t time) {
  const uint16_t ahead = (uint16_t)(time - hal_time());
  return native->now + (ahead != 0 ? ahead : 65536u);
}

void hal_slot_arm(uint16_t time) { native_next[EVENT_SLOT] = cycle_of(time); }

void hal_edge_arm(uint16_t time) { native_next[EVENT_EDGE] = cycle_of(time); }

void hal_edge_disarm(void) { native_next[EVENT_EDGE] = NATIVE_NEVER; }

void native_capture_reset(void) { capture = CAPTURE_OFF; }

void native_capture_edge(bool rising) {
  if (capture == (rising ? CAPTURE_RISING : CAPTURE_FALLING)) {
    native->interrupts++;
#ifdef LIGHT_LEFT_IS_CAPTURED
    light_on_left_fall(hal_time());
#else
    ping_on_edge(hal_time());
#endif
  }
}

void hal_capture_start(void) { capture = CAPTURE_RISING; }

void hal_capture_start_falling(void) { capture = CAPTURE_FALLING; }

void hal_capture_falling(void) { capture = CAPTURE_FALLING; }

void hal_capture_stop(void) { capture = CAPTURE_OFF; }
