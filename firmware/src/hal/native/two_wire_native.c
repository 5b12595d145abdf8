/* two_wire_native.c: the ATmega328P's two-wire unit as master (data sheet, 22), in steps of half a clock of 100 kHz: the data
 * line changes while the clock is low and is read when it has been high. A clock that a device holds low is waited for. */
#include "hal/hal.h"
#include "hal/interrupts.h"
#include "hal/native/events.h"

#define HALF_CLOCK 80u /* cycles: 5 us */
#define BITS 9u        /* of a byte and its acknowledgement */

typedef enum { NOTHING, START, SEND, RECEIVE, STOP } action;

static bool on;
static action doing;
static uint8_t half; /* steps of it that are done */
static uint8_t status, data;
static bool acknowledge; /* the byte received */
static bool answered;    /* the byte sent */
static bool addressing;  /* the byte sent is the first after a start */
static bool reading;     /* its lowest bit said so */
static bool owns_bus;    /* between a start and a stop */

static void data_line(bool low) { native_pull(PIN_COMPASS_SDA, low); }

static void clock_line(bool low) { native_pull(PIN_COMPASS_SCL, low); }

void native_two_wire_reset(void) {
  on = owns_bus = false;
  doing = NOTHING;
  native_next[EVENT_TWO_WIRE] = NATIVE_NEVER;
}

/* The action under way has ended. */
static void rest(void) {
  doing = NOTHING;
  native_next[EVENT_TWO_WIRE] = NATIVE_NEVER;
}

void hal_two_wire_on(void) { on = true; }

void hal_two_wire_off(void) {
  native_two_wire_reset();
  data_line(false);
  clock_line(false);
}

static void begin(action what) {
  if (on) {
    doing = what;
    half = 0;
    native_next[EVENT_TWO_WIRE] = native->now + HALF_CLOCK;
  }
}

void hal_two_wire_begin(void) { begin(START); }

void hal_two_wire_send(uint8_t byte) {
  data = byte;
  addressing = status == HAL_TWO_WIRE_STARTED || status == HAL_TWO_WIRE_STARTED_AGAIN;
  begin(SEND);
}

void hal_two_wire_receive(bool more) {
  acknowledge = more;
  data = 0;
  begin(RECEIVE);
}

void hal_two_wire_end(void) { begin(STOP); }

uint8_t hal_two_wire_status(void) { return status; }

uint8_t hal_two_wire_byte(void) { return data; }

static void done(uint8_t with) {
  status = with;
  rest();
  native->interrupts++;
  two_wire_on_step();
}

/* A start: both lines high, the data line falls, then the clock. It waits until the bus is free. */
static void step_start(void) {
  const uint8_t step = half++;
  if (step == 0) {
    data_line(false);
  } else if (step == 1) {
    clock_line(false);
  } else if (step > 2) {
    const uint8_t with = owns_bus ? HAL_TWO_WIRE_STARTED_AGAIN : HAL_TWO_WIRE_STARTED;
    clock_line(true);
    owns_bus = true;
    done(with);
  } else if (native_level(PIN_COMPASS_SDA) && native_level(PIN_COMPASS_SCL)) {
    data_line(true);
  } else {
    half = step;
  }
}

static void step_stop(void) {
  const uint8_t step = half++;
  if (step == 0) {
    data_line(true);
  } else if (step == 1) {
    clock_line(false);
  } else if (native_level(PIN_COMPASS_SCL)) {
    data_line(false);
    owns_bus = false;
    rest();
  } else {
    half = step;
  }
}

static uint8_t sent_status(void) {
  if (!addressing) {
    return answered ? HAL_TWO_WIRE_BYTE_TAKEN : HAL_TWO_WIRE_BYTE_REFUSED;
  }
  if (reading) {
    return answered ? HAL_TWO_WIRE_READ_TAKEN : HAL_TWO_WIRE_READ_REFUSED;
  }
  return answered ? HAL_TWO_WIRE_ADDRESS_TAKEN : HAL_TWO_WIRE_ADDRESS_REFUSED;
}

/* Puts bit `bit` of the byte or its acknowledgement on the data line; the clock is low. */
static void put_bit(uint8_t bit) {
  if (bit == BITS - 1u) {
    data_line(doing == RECEIVE && acknowledge);
  } else {
    data_line(doing == SEND && ((unsigned)data >> (7u - bit) & 1u) == 0);
  }
}

/* Reads it, at the end of the clock's high half. */
static void read_bit(uint8_t bit) {
  const bool high = native_level(PIN_COMPASS_SDA);
  if (bit == BITS - 1u) {
    answered = !high;
  } else if (doing == RECEIVE) {
    data = (uint8_t)((unsigned)data << 1 | (high ? 1u : 0u));
  }
}

/* Three steps a bit: data, clock up, clock down. */
static void step_byte(void) {
  const uint8_t bit = half / 3u;
  switch (half % 3u) {
    case 0:
      reading = (data & 1u) != 0;
      put_bit(bit);
      native_next[EVENT_TWO_WIRE] = native->now + HALF_CLOCK / 2u;
      half++;
      break;
    case 1:
      clock_line(false);
      half++;
      break;
    default:
      if (!native_level(PIN_COMPASS_SCL)) {
        break; /* held low */
      }
      read_bit(bit);
      clock_line(true);
      half++;
      native_next[EVENT_TWO_WIRE] = native->now + HALF_CLOCK / 2u; /* data in the middle of the low half */
      if (half == 3u * BITS) {
        const uint8_t received = acknowledge ? HAL_TWO_WIRE_BYTE_READ : HAL_TWO_WIRE_LAST_READ;
        done(doing == SEND ? sent_status() : received);
      }
      break;
  }
}

void native_two_wire_step(void) {
  native_next[EVENT_TWO_WIRE] += HALF_CLOCK;
  switch (doing) {
    case START:
      step_start();
      break;
    case STOP:
      step_stop();
      break;
    case SEND:
    case RECEIVE:
      step_byte();
      break;
    default:
      rest();
      break;
  }
}
