/* machine.h: what surrounds the firmware in a PC process, the border between hal/native and the program that loads it.
 *
 * The library exports one function, firmware_board_api(). Its owner keeps a native_machine: everything that outlives a
 * reset of the microcontroller (time, levels that the outside drives, bytes under way, EEPROM, counters). Each loaded copy
 * of the library is one microcontroller, from start() to the copy's unloading, which is its reset.
 *
 * Time is in cycles of 16 MHz. The owner queues input edges and bytes; the library takes them in order of time, and
 * calls the owner for each output edge and for bytes that leave.
 */
#ifndef NATIVE_MACHINE_H
#define NATIVE_MACHINE_H

#include <stddef.h>
#include <stdint.h>

#define NATIVE_API_VERSION 5u
#define NATIVE_PINS 20u
#define NATIVE_BAUD 500000u     /* of the board until the program selects another */
#define NATIVE_BYTE_CYCLES 320u /* 10 bits of it */
#define NATIVE_EEPROM_SIZE 1024u
#define NATIVE_EEPROM_CYCLES 54400u /* a write: 3.4 ms (data sheet of the ATmega328P, table 8-1) */
#define NATIVE_NOINIT_SIZE 32u
#define NATIVE_NEVER UINT64_MAX
#define NATIVE_SUPPLY 128u /* not a channel: the voltage of the supply */

/* What a pin is given, by the firmware or (the first three) from outside; the numbers are those of the board interface. */
enum { NATIVE_LOW = 0, NATIVE_HIGH = 1, NATIVE_RELEASED = 2, NATIVE_PULLED_UP = 3 };

typedef struct {
  uint64_t cycle;
  uint8_t level;
} native_edge;

/* First in, first out; in order of time. */
typedef struct {
  native_edge *edges;
  size_t first, count, capacity;
} native_edge_queue;

typedef struct {
  uint64_t cycle; /* end of the stop bit */
  uint8_t byte;
  uint32_t baud; /* the sender's bit rate; 0: the receiver's own */
} native_byte;

typedef struct {
  native_byte *bytes;
  size_t first, count, capacity;
} native_byte_queue;

typedef struct native_machine native_machine;
struct native_machine {
  uint64_t now;
  uint64_t next_edge; /* cycle of the earliest queued input edge, or NATIVE_NEVER */
  uint64_t next_byte; /* cycle of the earliest byte on its way in, or NATIVE_NEVER */
  uint8_t next_edge_pin;
  uint8_t stop;                 /* not 0: advance() returns after the event at hand */
  uint8_t output[NATIVE_PINS];  /* what the firmware does */
  uint8_t outside[NATIVE_PINS]; /* what the outside does */
  native_edge_queue edges[NATIVE_PINS];
  native_byte_queue incoming;
  uint64_t interrupts, bytes_in, overruns, framing_errors;

  /* Called at each change of output[]. */
  void (*edge)(native_machine *self, uint64_t cycle, uint8_t pin, uint8_t level);
  /* Called when bytes are handed to the sender: the first one's stop bit ends at `cycle`, the others follow back to
   * back. */
  void (*transmit)(native_machine *self, uint64_t cycle, const uint8_t *bytes, size_t count);

  uint32_t baud; /* of the board's side of the line; a start sets it to NATIVE_BAUD */

  /* EEPROM, and the write under way: its cell gets the value at cycle `eeprom_done`. */
  uint8_t eeprom[NATIVE_EEPROM_SIZE];
  uint8_t eeprom_writing;
  uint8_t eeprom_value;
  uint16_t eeprom_address;
  uint64_t eeprom_done;

  /* Memory that no start clears; its owner spoils it when the power comes. */
  uint8_t noinit[NATIVE_NOINIT_SIZE];

  /* Voltage at analog channel 0..5, or of the supply (NATIVE_SUPPLY); NULL: 0 V and the nominal 5 V. */
  double (*analog)(native_machine *self, uint64_t cycle, uint8_t channel);
};

typedef struct {
  uint32_t version; /* NATIVE_API_VERSION */
  const char *pin_map;

  /* The microcontroller starts at machine->now. Call once. reset_cause: RESET_CAUSE_... of generated/messages.h. */
  void (*start)(native_machine *machine, uint8_t reset_cause);

  /* Handles everything up to and including cycle `until`, in order of time. */
  void (*advance)(uint64_t until);
} native_api;

#if defined(_WIN32)
#define NATIVE_EXPORT __declspec(dllexport)
#else
#define NATIVE_EXPORT __attribute__((visibility("default")))
#endif

#define NATIVE_API_SYMBOL "firmware_board_api"
typedef const native_api *native_api_function(void);

/* Cycles of a byte of ten bits. */
static inline uint64_t native_byte_cycles(uint32_t baud) { return 10u * 16000000u / baud; }

/* Whether two sides of a line are too far apart to understand each other: more than 4 % (data sheet, table 20-2). */
static inline int native_rates_differ(uint32_t one, uint32_t other) {
  const uint32_t difference = one > other ? one - other : other - one;
  return difference > other / 25u;
}

/* What either side reads instead of a byte when the rates differ: never the byte itself, also not when it goes back and
 * forth, and never the end of a frame. */
static inline uint8_t native_garbled(uint8_t byte) {
  const uint8_t garbled = (uint8_t)(5u * byte + 45u);
  return garbled != 0u ? garbled : 0xFEu;
}

/* Finds the earliest queued input edge; pins at the same cycle go in order of their numbers. */
static inline void native_find_next_edge(native_machine *machine) {
  uint64_t next = NATIVE_NEVER;
  for (uint8_t pin = 0; pin < NATIVE_PINS; pin++) {
    const native_edge_queue *queue = &machine->edges[pin];
    if (queue->count > 0 && queue->edges[queue->first].cycle < next) {
      next = queue->edges[queue->first].cycle;
      machine->next_edge_pin = pin;
    }
  }
  machine->next_edge = next;
}

/* Takes the earliest input edge; there must be one. */
static inline native_edge native_take_edge(native_machine *machine) {
  native_edge_queue *queue = &machine->edges[machine->next_edge_pin];
  const native_edge edge = queue->edges[queue->first];
  queue->count--;
  queue->first = queue->count == 0 ? 0 : queue->first + 1;
  native_find_next_edge(machine);
  return edge;
}

/* Takes the earliest incoming byte; there must be one. */
static inline native_byte native_take_byte(native_machine *machine) {
  native_byte_queue *queue = &machine->incoming;
  const native_byte byte = queue->bytes[queue->first];
  queue->count--;
  queue->first = queue->count == 0 ? 0 : queue->first + 1;
  machine->next_byte = queue->count == 0 ? NATIVE_NEVER : queue->bytes[queue->first].cycle;
  return byte;
}

#endif
