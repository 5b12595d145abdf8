/* script_board.c: see script_board.h. */
#include "script_board.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
  uint64_t cycle;
  uint8_t pin;
  uint8_t value; /* level of an edge, or a byte */
} script_event;

typedef struct {
  script_event *event;
  size_t count, capacity;
} script_list;

struct script_board {
  board board; /* first: the address of the one is the address of the other */
  uint64_t now;
  script_list edges;
  size_t played;
  script_list bytes;
  size_t fetched;
  script_list input[BOARD_PIN_COUNT]; /* past and future, in order */
  script_list sent;
  uint8_t output[BOARD_PIN_COUNT];
  board_analog_source *source;
  void *source_context;
  uint64_t resets;
  int crashed;
  int held;
};

static int add(script_list *list, uint64_t cycle, uint8_t pin, uint8_t value) {
  if (list->count == list->capacity) {
    const size_t capacity = list->capacity == 0 ? 64 : 2 * list->capacity;
    script_event *event = realloc(list->event, capacity * sizeof *event);
    if (event == NULL) return -1;
    list->event = event;
    list->capacity = capacity;
  }
  list->event[list->count++] = (script_event){cycle, pin, value};
  return 0;
}

static script_board *of(board *b) { return (script_board *)b; }
static const script_board *of_const(const board *b) { return (const script_board *)b; }

static void destroy(board *b) {
  script_board *self = of(b);
  free(self->edges.event);
  free(self->bytes.event);
  free(self->sent.event);
  for (size_t pin = 0; pin < BOARD_PIN_COUNT; pin++) free(self->input[pin].event);
  free(self);
}

static uint64_t now(const board *b) { return of_const(b)->now; }

static board_state advance(board *b, uint64_t until) {
  script_board *self = of(b);
  if (self->crashed) return BOARD_CRASHED;
  while (self->played < self->edges.count && self->edges.event[self->played].cycle <= until) {
    const script_event edge = self->edges.event[self->played++];
    if (edge.cycle > self->now) self->now = edge.cycle;
    if (self->held) continue; /* a board in reset does nothing */
    self->output[edge.pin] = edge.value;
    if (board_show_edge(b, edge.cycle, edge.pin, edge.value)) break;
  }
  if (board_takes_pause(b)) return BOARD_PAUSED;
  if (until > self->now) self->now = until;
  return BOARD_RUNNING;
}

static void drive(board *b, uint64_t at, uint8_t pin, uint8_t level) {
  script_board *self = of(b);
  script_list *list = &self->input[pin];
  if (at < self->now) at = self->now;
  while (list->count > 0 && list->event[list->count - 1].cycle >= at &&
         list->event[list->count - 1].cycle > self->now) {
    list->count--;
  }
  add(list, at, pin, level);
}

static uint8_t output(const board *b, uint8_t pin) { return of_const(b)->output[pin]; }

static void analog(board *b, board_analog_source *source, void *context) {
  of(b)->source = source;
  of(b)->source_context = context;
}

static void send(board *b, uint64_t at, const uint8_t *bytes, size_t count) {
  for (size_t i = 0; i < count; i++) add(&of(b)->sent, at, 0, bytes[i]);
}

static size_t receive(board *b, uint8_t *bytes, uint64_t *cycles, size_t capacity) {
  script_board *self = of(b);
  size_t count = 0;
  while (count < capacity && self->fetched < self->bytes.count && self->bytes.event[self->fetched].cycle <= self->now) {
    const script_event byte = self->bytes.event[self->fetched++];
    bytes[count] = byte.value;
    if (cycles != NULL) cycles[count] = byte.cycle;
    count++;
  }
  return count;
}

static void line_rate(board *b, uint32_t baud) {
  (void)b;
  (void)baud;
}

static void reset(board *b, board_reset_cause cause) {
  (void)cause;
  of(b)->resets++;
}

static void hold(board *b, bool held) {
  script_board *self = of(b);
  if (held && !self->held) self->resets++;
  self->held = held;
}

static void counters(const board *b, board_counters *out) {
  const script_board *self = of_const(b);
  memset(out, 0, sizeof *out);
  out->bytes_in = self->sent.count;
  out->bytes_out = self->fetched;
  out->edges_out = self->played;
  out->resets = self->resets;
}

static const char *fault(const board *b) { return of_const(b)->crashed ? "the script says so" : NULL; }

static void *extension(board *b, const char *name) {
  (void)b;
  (void)name;
  return NULL;
}

static const board_operations operations = {
    .version = BOARD_INTERFACE_VERSION,
    .kind = "script",
    .destroy = destroy,
    .now = now,
    .advance = advance,
    .drive = drive,
    .output = output,
    .analog = analog,
    .send = send,
    .receive = receive,
    .line_rate = line_rate,
    .reset = reset,
    .hold = hold,
    .counters = counters,
    .fault = fault,
    .extension = extension,
};

script_board *script_board_new(void) {
  script_board *self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
  self->board.op = &operations;
  memset(self->output, BOARD_RELEASED, sizeof self->output);
  return self;
}

void script_board_destroy(script_board *self) {
  if (self != NULL) destroy(&self->board);
}

uintptr_t script_board_address(script_board *self) { return (uintptr_t)&self->board; }

int script_board_edge(script_board *self, uint64_t cycle, uint8_t pin, uint8_t level) {
  if (pin >= BOARD_PIN_COUNT) return -1;
  if (self->edges.count > 0 && cycle < self->edges.event[self->edges.count - 1].cycle) return -1;
  return add(&self->edges, cycle, pin, level);
}

int script_board_byte(script_board *self, uint64_t cycle, uint8_t byte) {
  if (self->bytes.count > 0 && cycle < self->bytes.event[self->bytes.count - 1].cycle) return -1;
  return add(&self->bytes, cycle, 0, byte);
}

size_t script_board_inputs(const script_board *self, uint8_t pin, uint64_t *cycles, uint8_t *levels, size_t capacity) {
  if (pin >= BOARD_PIN_COUNT) return 0;
  const script_list *list = &self->input[pin];
  size_t count = 0;
  for (size_t i = 0; i < list->count && list->event[i].cycle <= self->now; i++, count++) {
    if (count >= capacity) continue;
    cycles[count] = list->event[i].cycle;
    levels[count] = list->event[i].value;
  }
  return count;
}

size_t script_board_sent(const script_board *self, uint8_t *bytes, size_t capacity) {
  for (size_t i = 0; i < self->sent.count && i < capacity; i++) bytes[i] = self->sent.event[i].value;
  return self->sent.count;
}

double script_board_volts(script_board *self, uint8_t channel) {
  return self->source == NULL ? 0.0 : self->source(self->source_context, self->now, channel);
}

void script_board_crash(script_board *self) { self->crashed = 1; }
