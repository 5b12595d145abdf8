/* hal_native.c: the microcontroller as an event queue. Each source of interrupts has the cycle of its next event; the
 * earliest comes first, the firmware's interrupt runs at that cycle, and then its main loop if the event would have
 * woken it with something to do. Between events nothing happens, so nothing is spent. */
#include <string.h>

#include "firmware.h"
#include "generated/messages.h"
#include "hal/hal.h"
#include "hal/native/machine.h"
#include "pins.h"

#define RECEIVE_RING 256u
#define SEND_RING 128u
#define PING_TRIGGER_CYCLES (5u * HAL_CYCLES_PER_US)

uint8_t hal_native_port_b, hal_native_port_c, hal_native_port_d;

static native_machine *machine;
static uint8_t reset_cause;
static uint64_t epoch; /* cycle at which the timer read 0 */

/* Cycles of the next events. */
static uint64_t next_slot = NATIVE_NEVER;
static uint64_t next_edge_match = NATIVE_NEVER;
static uint64_t next_carrier = NATIVE_NEVER;
static uint64_t next_room = NATIVE_NEVER;   /* when a sender that asked for room has it */
static uint64_t next_eeprom = NATIVE_NEVER; /* the end of a write, or the next ready interrupt */
static uint64_t next_supply = NATIVE_NEVER; /* the end of a measurement */

static uint8_t carrier_pin;
static bool level_high[NATIVE_PINS]; /* PORT bits */
static bool is_output[NATIVE_PINS];  /* DDR bits */
static uint8_t pin_change_bits;      /* port C */
static enum { CAPTURE_OFF, CAPTURE_RISING, CAPTURE_FALLING } capture;
static uint16_t capture_time;

static uint8_t receive_ring[RECEIVE_RING];
static uint16_t receive_first, receive_count;
static bool overrun;
static bool zero_received;
static uint8_t to_send[SEND_RING]; /* from hal_serial_place() on */
static uint64_t sender_free;       /* cycle at which the last queued byte has left */
static bool eeprom_interrupt;
static uint16_t supply_result;

/* ---- pins ---- */

static uint8_t *port_of(uint8_t pin) {
  return pin < 8 ? &hal_native_port_d : pin < 14 ? &hal_native_port_b : &hal_native_port_c;
}

static uint8_t bit_of(uint8_t pin) { return (uint8_t)(1u << (pin < 8 ? pin : pin < 14 ? pin - 8 : pin - 14)); }

hal_change hal_changes[HAL_CHANGES + 1u];
volatile uint8_t hal_changes_head, hal_changes_tail;
static bool changes_stopped;

uint8_t hal_changes_stopped(void) { return changes_stopped; }

void hal_changes_resume(void) { changes_stopped = false; }

/* The pin-change interrupt. */
static void pin_change(void) {
  volatile hal_change *place = hal_change_after(hal_changes_head);
  const volatile hal_change *previous = place - 1;
  place->time = hal_time();
  place->bits = PINC;
  place->close = (uint16_t)(place->time - previous->time) < HAL_CHANGES_CLOSE ? (uint8_t)(previous->close + 1u) : 0u;
  const uint8_t next = (uint8_t)(hal_changes_head + HAL_CHANGE_BYTES);
  const bool full = next == hal_changes_tail;
  if (full || place->close >= HAL_CHANGES_STORM) {
    hal_pin_change_mask(0);
    changes_stopped = true;
  }
  if (!full) {
    hal_changes_head = next;
    if (next == 0) { /* the last place is also the first */
      hal_changes[0] = *place;
    }
  }
}

/* Works out the level on a pin; interrupts if it has changed. */
static void settle(uint8_t pin) {
  uint8_t state = machine->output[pin];
  if (state == NATIVE_RELEASED || state == NATIVE_PULLED_UP) {
    if (machine->outside[pin] != NATIVE_RELEASED) {
      state = machine->outside[pin];
    }
  }
  const bool high = state == NATIVE_HIGH || state == NATIVE_PULLED_UP;
  uint8_t *port = port_of(pin);
  const uint8_t bit = bit_of(pin);
  const bool was_high = (*port & bit) != 0;
  if (high == was_high) {
    return;
  }
  *port = (uint8_t)(*port ^ bit);
  if (port == &hal_native_port_c && (pin_change_bits & bit) != 0) {
    machine->interrupts++;
    pin_change();
  }
  if (pin == PIN_PING && capture == (high ? CAPTURE_RISING : CAPTURE_FALLING)) {
    capture_time = hal_time();
    machine->interrupts++;
    hal_native_capture();
  }
}

/* Tells the outside what the firmware now does to a pin. */
static void show(uint8_t pin) {
  const uint8_t state = is_output[pin] ? (level_high[pin] ? NATIVE_HIGH : NATIVE_LOW)
                                       : (level_high[pin] ? NATIVE_PULLED_UP : NATIVE_RELEASED);
  if (state != machine->output[pin]) {
    machine->output[pin] = state;
    machine->edge(machine, machine->now, pin, state);
    settle(pin);
  }
}

void hal_native_direction(uint8_t pin, bool output) {
  is_output[pin] = output;
  show(pin);
}

void hal_native_write(uint8_t pin, bool high) {
  level_high[pin] = high;
  show(pin);
}

void hal_native_toggle(uint8_t pin) { hal_native_write(pin, !level_high[pin]); }

void hal_pin_change_mask(uint8_t bits) { pin_change_bits = bits; }

/* ---- time ---- */

uint16_t hal_time(void) { return (uint16_t)(machine->now - epoch); }

void hal_start_timers(void) {
  epoch = machine->now;
  next_slot = epoch + HAL_SLOT_CYCLES;
}

/* The cycle at which the count will be `time` next. */
static uint64_t cycle_of(uint16_t time) {
  const uint16_t ahead = (uint16_t)(time - hal_time());
  return machine->now + (ahead != 0 ? ahead : 65536u);
}

void hal_slot_arm(uint16_t time) { next_slot = cycle_of(time); }

void hal_edge_arm(uint16_t time) { next_edge_match = cycle_of(time); }

void hal_edge_disarm(void) { next_edge_match = NATIVE_NEVER; }

/* ---- devices ---- */

void hal_carrier_start(uint8_t side) {
  carrier_pin = side == LEFT ? PIN_INFRARED_LEFT_LED : PIN_INFRARED_RIGHT_LED;
  next_carrier = machine->now + HAL_CARRIER_CYCLES;
}

void hal_carrier_stop(void) {
  next_carrier = NATIVE_NEVER;
  hal_native_write(carrier_pin, false);
}

void hal_ping_trigger(void) {
  capture = CAPTURE_OFF;
  HAL_PIN_LOW(PING);
  HAL_PIN_OUTPUT(PING);
  HAL_PIN_HIGH(PING);
  machine->now += PING_TRIGGER_CYCLES;
  HAL_PIN_LOW(PING);
  HAL_PIN_INPUT(PING);
  capture = CAPTURE_RISING;
}

uint16_t hal_capture_time(void) { return capture_time; }

void hal_capture_falling(void) { capture = CAPTURE_FALLING; }

void hal_capture_stop(void) { capture = CAPTURE_OFF; }

/* ---- serial line ---- */

void hal_start_serial(uint32_t baud) {
  sender_free = machine->now;
  machine->baud = baud;
}

bool hal_serial_receive(uint8_t *byte) {
  if (receive_count == 0) {
    return false;
  }
  *byte = receive_ring[receive_first];
  receive_first = (uint16_t)((receive_first + 1u) % RECEIVE_RING);
  receive_count--;
  return true;
}

uint8_t hal_serial_due(void) { return zero_received || receive_count >= RECEIVE_RING / 4u; }

void hal_serial_seen(void) { zero_received = false; }

void hal_serial_again(void) { zero_received = true; }

bool hal_serial_received(void) { return receive_count != 0; }

bool hal_serial_overrun(void) {
  const bool lost = overrun;
  overrun = false;
  return lost;
}

bool hal_serial_room(uint8_t count) {
  /* Bytes not yet wholly sent stand in the ring, but for the one being shifted out. */
  const uint64_t byte_cycles = native_byte_cycles(machine->baud);
  const uint64_t queued = sender_free > machine->now ? (sender_free - machine->now) / byte_cycles : 0;
  if (queued + count <= SEND_RING) {
    return true;
  }
  next_room = sender_free - (SEND_RING - (uint64_t)count + 1u) * byte_cycles + 1u;
  return false;
}

uint8_t *hal_serial_place(void) { return to_send; }

void hal_serial_queue(uint8_t count) { hal_serial_send(to_send, count); }

void hal_serial_send(const uint8_t *bytes, uint8_t count) {
  const uint64_t start = sender_free > machine->now ? sender_free : machine->now;
  const uint64_t byte_cycles = native_byte_cycles(machine->baud);
  machine->transmit(machine, start + byte_cycles, bytes, count);
  sender_free = start + count * byte_cycles;
}

static void byte_arrived(void) {
  native_byte byte = native_take_byte(machine);
  machine->bytes_in++;
  machine->interrupts++;
  if (byte.baud != 0 && native_rates_differ(byte.baud, machine->baud)) {
    machine->framing_errors++; /* a byte is read all the same; the frame's checksum refuses it */
    byte.byte = native_garbled(byte.byte);
  }
  if (receive_count == RECEIVE_RING - 1u) {
    overrun = true;
  } else {
    receive_ring[(receive_first + receive_count) % RECEIVE_RING] = byte.byte;
    receive_count++;
    zero_received = zero_received || byte.byte == 0;
  }
}

/* ---- EEPROM ---- */

/* Entry, a handler of a few instructions, return, and the one instruction of the main loop in between. */
#define READY_AGAIN_CYCLES 32u

/* For programs that do not write. */
__attribute__((weak)) HAL_INTERRUPT_EEPROM {}

static void plan_eeprom(uint64_t ready) {
  next_eeprom = machine->eeprom_writing ? machine->eeprom_done : eeprom_interrupt ? ready : NATIVE_NEVER;
}

bool hal_eeprom_busy(void) { return machine->eeprom_writing != 0; }

static void end_eeprom_write(void) {
  machine->eeprom[machine->eeprom_address] = machine->eeprom_value;
  machine->eeprom_writing = 0;
}

void hal_eeprom_wait(void) {
  if (hal_eeprom_busy()) {
    machine->now = machine->now > machine->eeprom_done ? machine->now : machine->eeprom_done;
    end_eeprom_write();
    plan_eeprom(machine->now);
  }
}

uint8_t hal_eeprom_read(uint16_t address) {
  if (hal_eeprom_busy()) {
    return machine->eeprom_value; /* as on the chip: nothing is read, the data register stays */
  }
  return machine->eeprom[address % NATIVE_EEPROM_SIZE];
}

void hal_eeprom_write_start(uint16_t address, uint8_t value) {
  if (hal_eeprom_busy()) {
    return;
  }
  machine->eeprom_writing = 1;
  machine->eeprom_address = address % NATIVE_EEPROM_SIZE;
  machine->eeprom_value = value;
  machine->eeprom_done = machine->now + NATIVE_EEPROM_CYCLES;
  plan_eeprom(machine->now);
}

void hal_eeprom_interrupt(bool on) {
  eeprom_interrupt = on;
  plan_eeprom(machine->now);
}

/* The end of a write, at which the interrupt is due too, or the interrupt. */
static void eeprom_event(void) {
  if (machine->eeprom_writing) {
    end_eeprom_write();
    plan_eeprom(machine->now);
    return;
  }
  machine->interrupts++;
  hal_native_eeprom();
  plan_eeprom(machine->now + READY_AGAIN_CYCLES);
}

/* ---- memory that a reset leaves alone ---- */

void *hal_noinit(void) { return machine->noinit; }

/* FNV-1a of it: the rest of the memory is this process's. */
uint32_t hal_memory_noise(void) {
  uint32_t hash = 0x811C9DC5u;
  for (size_t i = 0; i < sizeof machine->noinit; i++) {
    hash = (hash ^ machine->noinit[i]) * 0x01000193u;
  }
  return hash;
}

/* ---- supply ---- */

#define CONVERSION_CYCLES (104u * HAL_CYCLES_PER_US) /* 13 cycles of 125 kHz */
#define NOMINAL_VOLTS 5.0
#define BAND_GAP_VOLTS 1.1

void hal_supply_sample(void) {
  if (next_supply == NATIVE_NEVER) {
    next_supply = machine->now + CONVERSION_CYCLES;
  }
}

uint16_t hal_supply_result(void) { return supply_result; }

static void supply_measured(void) {
  const double volts = machine->supply != NULL ? machine->supply(machine, machine->now) : NOMINAL_VOLTS;
  const double steps = BAND_GAP_VOLTS * 1024.0 / volts;
  next_supply = NATIVE_NEVER;
  supply_result = steps < 1023.0 ? (uint16_t)steps : 1023u;
}

/* ---- the rest of hal.h ---- */

uint8_t hal_reset_cause(void) { return reset_cause; }

void hal_start_watchdog(void) {}
void hal_kick_watchdog(void) {}
void hal_watchdog_reset(void) {}

uint32_t hal_image_size(void) { return 0; }

uint32_t hal_image_hash(void) { return 0; }

/* ---- the event queue ---- */

static void poll_firmware(void) {
  do {
    firmware_poll();
  } while (firmware_due());
}

static void start(native_machine *owner, uint8_t cause) {
  machine = owner;
  reset_cause = cause;
  hal_native_port_b = hal_native_port_c = hal_native_port_d = 0;
  next_slot = next_edge_match = next_carrier = next_room = next_supply = NATIVE_NEVER;
  machine->baud = NATIVE_BAUD;
  eeprom_interrupt = false;
  supply_result = 0;
  plan_eeprom(machine->now); /* a write goes on */
  memset(level_high, 0, sizeof level_high);
  memset(is_output, 0, sizeof is_output);
  pin_change_bits = 0;
  capture = CAPTURE_OFF;
  receive_first = receive_count = 0;
  overrun = zero_received = false;
  for (uint8_t pin = 0; pin < NATIVE_PINS; pin++) {
    show(pin); /* a reset releases every pin */
    settle(pin);
  }
  firmware_start();
  poll_firmware();
}

/* Bursts are three thousand edges a second: a loop of their own, until something else comes. */
static void run_carrier(uint64_t until) {
  do {
    machine->now = next_carrier;
    next_carrier += HAL_CARRIER_CYCLES;
    machine->interrupts++;
    hal_native_toggle(carrier_pin);
  } while (next_carrier <= until && next_carrier < machine->next_edge && next_carrier < machine->next_byte &&
           next_carrier < next_slot && next_carrier < next_edge_match && next_carrier < next_room &&
           next_carrier < next_eeprom && next_carrier < next_supply && !machine->stop);
}

static void advance(uint64_t until) {
  while (!machine->stop) {
    /* At the same cycle: input edges, bytes, carrier, exact edges, slots, what is left. */
    uint64_t next = machine->next_edge;
    enum { PIN, BYTE, CARRIER, EDGE, SLOT, ROOM, SUPPLY, EEPROM } kind = PIN;
    if (machine->next_byte < next) {
      next = machine->next_byte;
      kind = BYTE;
    }
    if (next_carrier < next) {
      next = next_carrier;
      kind = CARRIER;
    }
    if (next_edge_match < next) {
      next = next_edge_match;
      kind = EDGE;
    }
    if (next_slot < next) {
      next = next_slot;
      kind = SLOT;
    }
    if (next_room < next) {
      next = next_room;
      kind = ROOM;
    }
    if (next_supply < next) {
      next = next_supply;
      kind = SUPPLY;
    }
    if (next_eeprom < next) {
      next = next_eeprom;
      kind = EEPROM;
    }
    if (next > until) {
      break;
    }
    if (next > machine->now) {
      machine->now = next;
    }
    switch (kind) {
      case PIN: {
        const uint8_t pin = machine->next_edge_pin;
        machine->outside[pin] = native_take_edge(machine).level;
        settle(pin);
        if (firmware_due()) {
          poll_firmware();
        }
        break;
      }
      case BYTE:
        byte_arrived();
        poll_firmware();
        break;
      case CARRIER:
        run_carrier(until);
        break;
      case EDGE:
        next_edge_match = NATIVE_NEVER;
        machine->interrupts++;
        hal_native_edge();
        break;
      case SLOT:
        machine->interrupts++;
        hal_native_slot();
        poll_firmware();
        break;
      case ROOM:
        next_room = NATIVE_NEVER;
        poll_firmware();
        break;
      case SUPPLY:
        supply_measured();
        break;
      case EEPROM:
        eeprom_event();
        if (firmware_due()) {
          poll_firmware();
        }
        break;
    }
  }
  if (machine->now < until && !machine->stop) {
    machine->now = until;
  }
}

NATIVE_EXPORT const native_api *firmware_board_api(void);
const native_api *firmware_board_api(void) {
  static const native_api api = {NATIVE_API_VERSION, PIN_MAP_NAME, start, advance};
  return &api;
}
