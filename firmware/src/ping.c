/* ping.c: see ping.h. */
#include "ping.h"

#include <stdbool.h>

#include "clock.h"
#include "generated/values.h"
#include "hal/hal.h"
#include "hal/interrupts.h"
#include "parameters.h"
#include "tasks.h"

#define GIVE_UP_TICKS 2u /* 20 ms after the trigger: the sensor ends its pulse 19.3 ms after it at the latest */
#define AGE_UNIT 256u    /* cycles; a tick has TICK_UNITS of them, so that 16 bits are divided */
#define TICK_UNITS ((uint16_t)(HAL_SLOT_CYCLES * (uint32_t)CLOCK_SLOTS_PER_TICK / AGE_UNIT))
/* The sensor raises the line 750 us after the trigger (its manual gives no tolerance). An edge more than 2 % sooner, or more
 * than twice as late, is noise: a board that hears noise for an echo is worse than one that hears none. */
#define HOLD_OFF_MIN (735u * HAL_CYCLES_PER_US)
#define HOLD_OFF_MAX (1500u * HAL_CYCLES_PER_US)
#define NOISE_MAX 10u   /* such edges: then no other is waited for */
#define ECHO_MIN 100u   /* us; the sensor's shortest echo is 115 us */
#define ECHO_MAX 18300u /* us; without an echo its pulse lasts 18.5 ms */

/* Shared with the capture's interrupt, which only stamps; the stamps are settled when the state is ENDED or CUT. */
enum {
  IDLE,
  RISING,
  FALLING,
  ENDED,
  CUT
}; /* the edge that is awaited; CUT: the pulse ended before its end was awaited */
static volatile uint8_t state;
static volatile uint16_t triggered, rise, fall;  /* hal_time() */
static volatile uint8_t trigger_slot, rise_slot; /* clock_slot then */
static volatile uint32_t fall_slot_cycles;       /* clock_slot_cycles then */
static volatile uint8_t noise_left;              /* edges at other times than the sensor's that still count */

static uint32_t triggered_cycles; /* clock_now() */
static uint8_t status;
static uint16_t echo;
static uint8_t age;
static uint8_t since_trigger; /* ticks, saturating */
static bool is_held_low;

#ifdef PIN_PING
_Static_assert(PIN_PING == 8, "the timer captures on pin 8");

static void pull_up(void) {
  HAL_PIN_PULL_UP(PING);
  is_held_low = false;
}

static void hold_low(void) {
  HAL_PIN_OUTPUT_LOW(PING);
  is_held_low = true;
}

/* The sensor wants a pulse of 2 us at least; interrupts may make it longer. */
static void begin_pulse(void) {
  HAL_PIN_OUTPUT_LOW(PING);
  HAL_PIN_HIGH(PING);
  hal_wait(5u * HAL_CYCLES_PER_US);
}

static void end_pulse(void) {
  HAL_PIN_LOW(PING);
  HAL_PIN_INPUT(PING);
}

static bool is_low(void) { return HAL_PIN_READ(PING) == 0; }
#else /* a map without a Ping, which cannot be switched on */
static void pull_up(void) {}
static void hold_low(void) {}
static void begin_pulse(void) {}
static void end_pulse(void) {}
static bool is_low(void) { return false; }
#endif

void ping_start(void) {
  pull_up();
  hal_capture_stop();
  state = IDLE;
  status = PING_STATUS_OFF;
  echo = 0;
  age = AGE_NEVER;
  since_trigger = 255;
}

void ping_on_edge(uint16_t time) {
  if (state == FALLING) {
    fall = time;
    fall_slot_cycles = clock_slot_cycles;
    state = ENDED;
    hal_capture_stop();
  } else if ((uint16_t)(time - triggered - HOLD_OFF_MIN) <= HOLD_OFF_MAX - HOLD_OFF_MIN) {
    rise = time;
    rise_slot = clock_slot;
    hal_capture_falling();
    state = FALLING;
    if (is_low()) {
      state = CUT;
      hal_capture_stop();
    }
  } else if (--noise_left == 0) {
    hal_capture_stop();
  }
}

static void report(uint8_t what, uint16_t us) {
  status = what;
  echo = us;
  state = IDLE;
}

/* The pulse has ended. The stamps of 16 bits roll over after 4 ms: a rise in a later slot than the trigger's or the next was
 * none of the sensor's. */
static void take(void) {
  if ((uint8_t)(rise_slot - trigger_slot) > 1u) {
    age = 0;
    report(PING_STATUS_ABSENT, 0);
    return;
  }
  const uint32_t up = triggered_cycles + (uint16_t)(rise - triggered);
  const uint32_t down = state == CUT ? up : clock_cycles_in(fall_slot_cycles, fall);
  const uint32_t us = (down - up + HAL_CYCLES_PER_US / 2u) / HAL_CYCLES_PER_US;
  age = (uint8_t)((uint16_t)((clock_now() - down) / AGE_UNIT) / TICK_UNITS);
  if (us < ECHO_MIN) {
    report(PING_STATUS_TOO_NEAR, 0);
  } else if (us > ECHO_MAX) {
    report(PING_STATUS_NOTHING_NEAR, 0);
  } else {
    report(PING_STATUS_OK, (uint16_t)us);
  }
}

/* Once per tick, before the telemetry: takes over a measurement that has ended. */
void ping_echo_task(void) {
  if (state >= ENDED) {
    take();
  }
  clock_grow_older(&age);
  if (!parameters_device_in_use(DEVICES_PING)) {
    status = PING_STATUS_OFF;
    echo = 0;
    age = AGE_NEVER;
  }
}

/* No rising edge has come, or a pulse that does not end. */
static void give_up(void) {
  bool is_over = false;
  HAL_ATOMIC {
    is_over = state < ENDED;
    if (is_over) {
      hal_capture_stop();
      state = IDLE;
    }
  }
  if (is_over) {
    status = PING_STATUS_ABSENT;
    echo = 0;
    age = 0;
  }
}

static void trigger(void) {
  since_trigger = 0;
  noise_left = NOISE_MAX;
  is_held_low = false;
  begin_pulse();
  HAL_ATOMIC { /* the sensor counts from the pulse's end, and so does HOLD_OFF: no interrupt in between */
    end_pulse();
    triggered_cycles = clock_now();
    triggered = (uint16_t)triggered_cycles;
    trigger_slot = clock_slot;
    state = RISING;
    hal_capture_start();
  }
}

/* Once per tick: gives up a measurement and triggers the next one. From 20 ms after a trigger the line is the board's. */
void ping_task(void) {
  if (since_trigger < 255u) {
    since_trigger++;
  }
  const bool is_quiet = since_trigger >= GIVE_UP_TICKS;
  if ((state == RISING || state == FALLING) && is_quiet) {
    give_up();
  }
  if (!parameters_device_in_use(DEVICES_PING)) {
    pull_up();
  } else if (state == IDLE && since_trigger >= (uint8_t)parameters_u16(PARAMETER_PING_PERIOD)) {
    trigger();
  } else if (is_quiet && !is_held_low) {
    hold_low();
  }
}

void ping_report_telemetry(msg_telemetry *message) {
  message->ping_echo = echo;
  message->ping_age = age;
  message->ping_status = status;
}
