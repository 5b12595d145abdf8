/* infrared.c: see infrared.h. */
#include "infrared.h"

#include "clock.h"
#include "generated/values.h"
#include "hal/hal.h"
#include "hal/interrupts.h"
#include "parameters.h"
#include "tasks.h"

#define BURST_TOGGLES 76u /* 1 ms at 38 kHz */

/* Half a period in cycles: 37.91, 39.02, 40.00, 41.03, 42.11 kHz. */
#define BANDS 5u
static const uint8_t half_periods[BANDS] = {211, 205, 200, 195, 190};

typedef struct {
  /* Shared with the interrupts; single bytes. */
  volatile bool armed;          /* this tick shall have bursts */
  volatile bool started;        /* it has them, or had them: until the next tick's task has looked */
  volatile uint8_t band;        /* their frequency; changed between ticks with bursts only */
  volatile uint8_t saw_nothing; /* receivers that saw nothing before the burst of their side; INFRARED_... bits */

  /* Main loop only. */
  uint8_t reading;
  uint8_t age;
  uint8_t wait;      /* ticks until the next reading */
  bool is_connected; /* the board drives the LEDs' lines */
  bool sweeping;
  uint8_t counts[SIDES]; /* frequencies of the sweep at which an object was seen so far, */
  uint8_t zones[SIDES];  /* and in the last whole one */
  uint8_t zone_age;
} infrared_state;

static infrared_state own;

/* Not while there are bursts, which toggle the lines. */
static void connect_leds(bool connected) {
  if (connected) {
    HAL_PIN_LOW(INFRARED_LEFT_LED);
    HAL_PIN_LOW(INFRARED_RIGHT_LED);
    HAL_PIN_OUTPUT(INFRARED_LEFT_LED);
    HAL_PIN_OUTPUT(INFRARED_RIGHT_LED);
  } else {
    HAL_PIN_PULL_UP(INFRARED_LEFT_LED);
    HAL_PIN_PULL_UP(INFRARED_RIGHT_LED);
  }
  own.is_connected = connected;
}

void infrared_start(void) {
  HAL_PIN_PULL_UP(INFRARED_LEFT_RECEIVER);
  HAL_PIN_PULL_UP(INFRARED_RIGHT_RECEIVER);
  own = (infrared_state){.age = AGE_NEVER, .zone_age = AGE_NEVER};
  connect_leds(false);
}

/* The receivers whose output is high, INFRARED_... bits: they see nothing. */
static uint8_t saw_nothing(void) {
  return (uint8_t)((HAL_PIN_READ(INFRARED_LEFT_RECEIVER) != 0 ? INFRARED_LEFT : 0u) |
                   (HAL_PIN_READ(INFRARED_RIGHT_RECEIVER) != 0 ? INFRARED_RIGHT : 0u));
}

void infrared_begin(uint8_t side) {
  if (side == LEFT && own.armed) {
    own.started = true;
    own.armed = false;
  }
  if (own.started) {
    const uint8_t own_bit = side == LEFT ? INFRARED_LEFT : INFRARED_RIGHT;
    own.saw_nothing = (uint8_t)((own.saw_nothing & (uint8_t)~own_bit) | (saw_nothing() & own_bit));
    hal_burst_start(side, half_periods[own.band], BURST_TOGGLES);
  }
}

static uint8_t seen(void) {
  const uint8_t bits =
      (uint8_t)((hal_burst_seen(LEFT) ? INFRARED_LEFT : 0u) | (hal_burst_seen(RIGHT) ? INFRARED_RIGHT : 0u));
  return bits & own.saw_nothing;
}

/* What a tick's bursts found: at 38 kHz the reading, in a sweep a part of the zones as well. */
static void take(uint8_t seen_now) {
  if (own.band == 0) {
    own.reading = seen_now;
    own.age = 0;
    own.counts[LEFT] = own.counts[RIGHT] = 0;
  }
  if (!own.sweeping) {
    return;
  }
  own.counts[LEFT] = (uint8_t)(own.counts[LEFT] + ((seen_now & INFRARED_LEFT) != 0));
  own.counts[RIGHT] = (uint8_t)(own.counts[RIGHT] + ((seen_now & INFRARED_RIGHT) != 0));
  own.band++;
  if (own.band == BANDS) {
    own.band = 0;
    own.zones[LEFT] = own.counts[LEFT];
    own.zones[RIGHT] = own.counts[RIGHT];
    own.zone_age = 0;
  }
}

static void forget_sweep(void) {
  own.sweeping = false;
  own.band = 0;
  own.zones[LEFT] = own.zones[RIGHT] = 0;
  own.zone_age = AGE_NEVER;
}

/* Once per tick: takes over what the last burst found, and decides whether this tick has one. */
void infrared_task(void) {
  const bool had_bursts = own.started; /* in the tick before */
  if (had_bursts) {
    own.started = false;
    take(seen());
  }
  clock_grow_older(&own.age);
  clock_grow_older(&own.zone_age);
  if (own.wait > 0) {
    own.wait--;
  }
  const bool in_use = parameters_device_in_use(DEVICES_INFRARED);
  if (in_use != own.is_connected && !had_bursts) {
    connect_leds(in_use);
  }
  if (in_use && own.is_connected) {
    if (parameters_u16(PARAMETER_INFRARED_SWEEP) == 0) {
      forget_sweep();
    }
    if (own.band != 0) { /* the sweep goes on */
      own.armed = true;
    } else if (own.wait == 0) {
      own.sweeping = parameters_u16(PARAMETER_INFRARED_SWEEP) != 0;
      own.wait = (uint8_t)parameters_u16(PARAMETER_INFRARED_PERIOD);
      own.armed = true;
    }
  } else {
    own.armed = false;
    own.reading = 0;
    own.age = AGE_NEVER;
    forget_sweep();
  }
}

uint8_t infrared_read(void) { return own.reading; }

uint8_t infrared_age(void) { return own.age; }

void infrared_report_telemetry(msg_telemetry *message) {
  message->infrared = own.reading;
  message->infrared_age = own.age;
}

bool infrared_report_devices_telemetry(msg_devices_telemetry *message) {
  message->infrared_zone_left = own.zones[LEFT];
  message->infrared_zone_right = own.zones[RIGHT];
  message->infrared_zone_age = own.zone_age;
  return parameters_device_on(DEVICES_INFRARED) && parameters_u16(PARAMETER_INFRARED_SWEEP) != 0;
}
