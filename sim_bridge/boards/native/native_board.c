/* native_board.c: see native_board.h. Keeps what outlives a reset (hal/native/machine.h) and gives it the face of a
 * board. */
#include "boards/native/native_board.h"

#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "boards/native/library_copy.h"
#include "boards/queue.h"
#include "generated/messages.h"
#include "hal/native/machine.h"

#define SLOWEST_BAUD 300u

typedef struct {
  board face;
  native_machine machine;
  unsigned char *image; /* the library file */
  size_t image_size;
  library_copy library;
  const native_api *api;

  bool started; /* the program has begun; it does so at the first advance, when somebody listens */
  bool reset_asked;
  bool held; /* in brown-out reset */
  board_reset_cause reset_cause;
  char *fault; /* one sentence, or NULL */

  uint32_t baud;      /* of the outside's side of the line */
  uint64_t line_free; /* cycle at which the last byte to the board has arrived */
  native_byte_queue outgoing;
  uint64_t bytes_out; /* returned by receive() */
  uint64_t edges_out, resets;

  board_analog_source *analog_source;
  void *analog_context;
  board_eeprom eeprom;
} native_board;

static native_board *of_board(board *self) { return (native_board *)(void *)self; }

static const native_board *of_const_board(const board *self) { return (const native_board *)(const void *)self; }

static native_board *of_machine(native_machine *machine) {
  return (native_board *)(void *)((char *)machine - offsetof(native_board, machine));
}

static void push_edge(native_edge_queue *queue, native_edge edge) {
  size_t end = queue->first + queue->count++;
  queue->edges = board_room_for(queue->edges, sizeof edge, &queue->first, &end, &queue->capacity, 1);
  queue->edges[end] = edge;
}

static void push_byte(native_byte_queue *queue, native_byte byte) {
  size_t end = queue->first + queue->count++;
  queue->bytes = board_room_for(queue->bytes, sizeof byte, &queue->first, &end, &queue->capacity, 1);
  queue->bytes[end] = byte;
}

static void on_edge(native_machine *machine, uint64_t cycle, uint8_t pin, uint8_t level) {
  native_board *self = of_machine(machine);
  self->edges_out++;
  if (board_show_edge(&self->face, cycle, pin, level)) {
    machine->stop = 1;
  }
}

static void on_transmit(native_machine *machine, uint64_t cycle, const uint8_t *bytes, size_t count) {
  native_board *self = of_machine(machine);
  const uint64_t byte_cycles = native_byte_cycles(machine->baud);
  for (size_t i = 0; i < count; i++) {
    push_byte(&self->outgoing, (native_byte){cycle + i * byte_cycles, bytes[i], machine->baud});
  }
}

/* What the outside reads of a byte that has left, at the rate it has now. */
static void read_by_outside(const native_board *self, native_byte *byte) {
  if (byte->baud != 0 && native_rates_differ(self->baud, byte->baud)) {
    byte->byte = native_garbled(byte->byte);
  }
  byte->baud = 0;
}

_Static_assert(NATIVE_SUPPLY == BOARD_ANALOG_SUPPLY, "one number");

static double on_analog(native_machine *machine, uint64_t cycle, uint8_t channel) {
  const native_board *self = of_machine(machine);
  if (channel == NATIVE_SUPPLY) {
    return board_supply_volts(self->analog_source, self->analog_context, cycle);
  }
  return self->analog_source != NULL ? self->analog_source(self->analog_context, cycle, channel) : 0.0;
}

/* Loads a fresh copy of the library and finds its face. */
static bool load(native_board *self, char *error, size_t error_size) {
  if (!library_load(&self->library, self->image, self->image_size, error, error_size)) {
    return false;
  }
  native_api_function *function = NULL;
  void *symbol = library_symbol(&self->library, NATIVE_API_SYMBOL);
  memcpy(&function, &symbol, sizeof function);
  if (function == NULL) {
    snprintf(error, error_size, "the library is not a boebot firmware: it has no %s", NATIVE_API_SYMBOL);
    return false;
  }
  self->api = function();
  if (self->api->version != NATIVE_API_VERSION) {
    snprintf(error, error_size, "the firmware library speaks version %" PRIu32 " of the board's interface, not %u",
             self->api->version, NATIVE_API_VERSION);
    return false;
  }
  return true;
}

static const uint8_t CAUSES_ON_THE_WIRE[] = {
    [BOARD_RESET_POWER] = RESET_CAUSE_POWER,
    [BOARD_RESET_EXTERNAL] = RESET_CAUSE_EXTERNAL,
    [BOARD_RESET_BROWN_OUT] = RESET_CAUSE_BROWN_OUT,
    [BOARD_RESET_WATCHDOG] = RESET_CAUSE_WATCHDOG,
};

/* Takes bytes off the end of the line that have not wholly left by now. */
static void cut_outgoing(native_board *self) {
  native_byte_queue *queue = &self->outgoing;
  while (queue->count > 0 && queue->bytes[queue->first + queue->count - 1].cycle > self->machine.now) {
    queue->count--;
  }
}

/* Loses the byte that is arriving now; those that the outside sends later arrive. */
static void cut_incoming(native_board *self) {
  const uint64_t byte_cycles = native_byte_cycles(self->baud);
  if (self->machine.next_byte != NATIVE_NEVER && self->machine.next_byte < self->machine.now + byte_cycles) {
    (void)native_take_byte(&self->machine);
  }
}

/* What loss of supply does: a cell of the EEPROM that is being written is damaged; memory holds anything after power-on,
 * here always the same anything. */
static void lose_power(native_board *self) {
  native_machine *machine = &self->machine;
  if (machine->eeprom_writing) {
    uint8_t *cell = &machine->eeprom[machine->eeprom_address];
    *cell = board_damaged_cell(&self->eeprom, *cell, machine->eeprom_value);
    machine->eeprom_writing = 0;
  }
  if (self->reset_cause == BOARD_RESET_POWER) { /* anything, another at each power-on, the same in each run */
    uint32_t x = 0x328u + (uint32_t)self->resets * 0x9E3779B9u;
    for (size_t i = 0; i < sizeof machine->noinit; i++) {
      x = x * 1664525u + 1013904223u;
      machine->noinit[i] = (uint8_t)(x >> 24);
    }
  }
}

/* The program cannot go on, and why. */
static void keep_fault(native_board *self, const char *sentence) {
  const size_t size = strlen(sentence) + 1;
  self->api = NULL;
  self->fault = malloc(size);
  if (self->fault != NULL) {
    memcpy(self->fault, sentence, size);
  }
}

/* Begins the program, the first time or anew. */
static bool restart(native_board *self) {
  char error[256];
  self->reset_asked = false;
  self->machine.stop = 0;
  if (self->reset_cause == BOARD_RESET_POWER || self->reset_cause == BOARD_RESET_BROWN_OUT) {
    lose_power(self);
  }
  if (self->started) {
    self->resets++;
    cut_outgoing(self);
    cut_incoming(self);
    library_unload(&self->library);
    if (!load(self, error, sizeof error)) {
      keep_fault(self, error);
      return false;
    }
  }
  self->started = true;
  self->api->start(&self->machine, CAUSES_ON_THE_WIRE[self->reset_cause]);
  return true;
}

/* ---- the face of a board ---- */

static void board_destroy(board *face) {
  native_board *self = of_board(face);
  library_unload(&self->library);
  for (size_t pin = 0; pin < NATIVE_PINS; pin++) {
    free(self->machine.edges[pin].edges);
  }
  free(self->machine.incoming.bytes);
  free(self->outgoing.bytes);
  free(self->image);
  free(self->fault);
  free(self);
}

static uint64_t board_now(const board *face) { return of_const_board(face)->machine.now; }

/* An edge ends the run: once. A reset that was asked for comes with the next one. */
static bool is_paused(native_board *self) {
  if (!board_takes_pause(&self->face)) return false;
  self->machine.stop = self->reset_asked;
  return true;
}

static board_state board_advance(board *face, uint64_t until) {
  native_board *self = of_board(face);
  if (is_paused(self)) return BOARD_PAUSED;
  if (self->held) { /* nobody hears what comes meanwhile */
    if (until > self->machine.now) self->machine.now = until;
    while (self->machine.next_byte <= self->machine.now) (void)native_take_byte(&self->machine);
    return BOARD_RUNNING;
  }
  do {
    if (self->reset_asked && !restart(self)) {
      return BOARD_CRASHED;
    }
    if (self->api == NULL) {
      return BOARD_CRASHED;
    }
    self->api->advance(until);
    if (is_paused(self)) return BOARD_PAUSED;
  } while (self->reset_asked);
  return BOARD_RUNNING;
}

static void board_drive(board *face, uint64_t at, uint8_t pin, uint8_t level) {
  native_machine *machine = &of_board(face)->machine;
  if (pin >= NATIVE_PINS) {
    return;
  }
  native_edge_queue *queue = &machine->edges[pin];
  while (queue->count > 0 && queue->edges[queue->first + queue->count - 1].cycle >= at) {
    queue->count--;
  }
  push_edge(queue, (native_edge){at > machine->now ? at : machine->now, level});
  if (at <= machine->next_edge || machine->next_edge_pin == pin) {
    native_find_next_edge(machine);
  }
}

static uint8_t board_output(const board *face, uint8_t pin) {
  return pin < NATIVE_PINS ? of_const_board(face)->machine.output[pin] : (uint8_t)BOARD_RELEASED;
}

static void board_analog(board *face, board_analog_source *source, void *context) {
  native_board *self = of_board(face);
  self->analog_source = source;
  self->analog_context = context;
}

static void board_send(board *face, uint64_t at, const uint8_t *bytes, size_t count) {
  native_board *self = of_board(face);
  uint64_t start = at > self->machine.now ? at : self->machine.now;
  if (start < self->line_free) {
    start = self->line_free;
  }
  for (size_t i = 0; i < count; i++) {
    const uint64_t end = start + (i + 1) * 10u * (uint64_t)BOARD_CLOCK_HZ / self->baud;
    push_byte(&self->machine.incoming, (native_byte){end, bytes[i], self->baud});
    self->line_free = end;
  }
  const native_byte_queue *queue = &self->machine.incoming;
  if (queue->count > 0) {
    self->machine.next_byte = queue->bytes[queue->first].cycle;
  }
}

static size_t board_receive(board *face, uint8_t *bytes, uint64_t *cycles, size_t capacity) {
  native_board *self = of_board(face);
  native_byte_queue *queue = &self->outgoing;
  size_t count = 0;
  while (count < capacity && queue->count > 0 && queue->bytes[queue->first].cycle <= self->machine.now) {
    read_by_outside(self, &queue->bytes[queue->first]);
    bytes[count] = queue->bytes[queue->first].byte;
    if (cycles != NULL) {
      cycles[count] = queue->bytes[queue->first].cycle;
    }
    count++;
    queue->count--;
    queue->first = queue->count == 0 ? 0 : queue->first + 1;
  }
  self->bytes_out += count;
  return count;
}

static void board_line_rate(board *face, uint32_t baud) {
  native_board *self = of_board(face);
  const native_byte_queue *queue = &self->outgoing;
  for (size_t i = 0; i < queue->count && queue->bytes[queue->first + i].cycle <= self->machine.now; i++) {
    read_by_outside(self, &queue->bytes[queue->first + i]); /* these were read at the old rate */
  }
  self->baud = baud < SLOWEST_BAUD ? SLOWEST_BAUD : baud;
}

static void board_reset(board *face, board_reset_cause cause) {
  native_board *self = of_board(face);
  self->reset_asked = true;
  self->reset_cause = cause;
  self->machine.stop = 1;
}

/* Held, it lets go of its pins; the program begins anew when it is let go. */
static void board_hold(board *face, bool held) {
  native_board *self = of_board(face);
  if (held && !self->held) {
    for (uint8_t pin = 0; pin < NATIVE_PINS; pin++) {
      if (self->machine.output[pin] == NATIVE_RELEASED) continue;
      self->machine.output[pin] = NATIVE_RELEASED;
      on_edge(&self->machine, self->machine.now, pin, NATIVE_RELEASED);
    }
    if (self->started) board_reset(face, BOARD_RESET_BROWN_OUT);
  }
  self->held = held;
}

static void board_counters_now(const board *face, board_counters *out) {
  const native_board *self = of_const_board(face);
  const native_byte_queue *queue = &self->outgoing;
  uint64_t waiting = 0; /* bytes that have left and were not read yet */
  while (waiting < queue->count && queue->bytes[queue->first + waiting].cycle <= self->machine.now) {
    waiting++;
  }
  *out = (board_counters){
      .interrupts = self->machine.interrupts,
      .bytes_in = self->machine.bytes_in,
      .bytes_out = self->bytes_out + waiting,
      .overruns = self->machine.overruns,
      .framing_errors = self->machine.framing_errors,
      .resets = self->resets,
      .edges_out = self->edges_out,
  };
}

static const char *board_fault(const board *face) { return of_const_board(face)->fault; }

static void *board_extension(board *face, const char *name) {
  native_board *self = of_board(face);
  if (strcmp(name, BOARD_EEPROM) == 0) {
    return &self->eeprom;
  }
  return NULL;
}

static const board_operations operations = {
    .version = BOARD_INTERFACE_VERSION,
    .kind = "native",
    .destroy = board_destroy,
    .now = board_now,
    .advance = board_advance,
    .drive = board_drive,
    .output = board_output,
    .analog = board_analog,
    .send = board_send,
    .receive = board_receive,
    .line_rate = board_line_rate,
    .reset = board_reset,
    .hold = board_hold,
    .counters = board_counters_now,
    .fault = board_fault,
    .extension = board_extension,
};

board *native_board_create(const uint8_t *image, size_t size, char *error, size_t error_size) {
  native_board *self = calloc(1, sizeof *self);
  if (self == NULL) {
    snprintf(error, error_size, "out of memory");
    return NULL;
  }
  self->face.op = &operations;
  self->baud = NATIVE_BAUD;
  self->reset_asked = true;
  self->reset_cause = BOARD_RESET_POWER;
  native_machine *machine = &self->machine;
  machine->next_edge = NATIVE_NEVER;
  machine->next_byte = NATIVE_NEVER;
  machine->edge = on_edge;
  machine->transmit = on_transmit;
  machine->analog = on_analog;
  memset(machine->eeprom, 0xFF, sizeof machine->eeprom);
  self->eeprom.bytes = machine->eeprom;
  memset(machine->output, NATIVE_RELEASED, sizeof machine->output);
  memset(machine->outside, NATIVE_RELEASED, sizeof machine->outside);
  self->image = malloc(size + 1u);
  self->image_size = size;
  if (self->image != NULL) memcpy(self->image, image, size);
  if (self->image == NULL || !load(self, error, error_size)) {
    board_destroy(&self->face);
    return NULL;
  }
  return &self->face;
}
