/* avr_spans.c: see avr_spans.h.
 *
 * What runs lies on a stack of open spans. A span has ended when the stack pointer is above its value at the span's
 * beginning: RET and RETI take the return address off in one instruction, whatever jumped where before. A program sets
 * the stack pointer by two OUTs, upper half first (avr-libc, gcc); between them it means nothing.
 */
#include "avr_spans.h"

#include <stdlib.h>

#include "avr_board.h"
#include "avr_parts.h"
#include "core/avr_decode.h"

#define OPEN_MAXIMUM 64u
#define HALF_WRITTEN_STEPS 3u /* out SPH; out SREG; out SPL */

typedef struct {
  avr_span span;
  uint64_t interrupted; /* cycles of interrupts that came in between */
  uint16_t stack;       /* pointer at its beginning, below the return address */
} open_span;

typedef struct avr_recorder {
  avr_stops stops; /* marked: 1 + index of the function that begins there */
  uint64_t patience;
  avr_span *spans;
  size_t first, end, capacity;
  bool only_extremes;
  avr_extremes extremes[AVR_FUNCTIONS_MAXIMUM];
  open_span open[OPEN_MAXIMUM];
  unsigned open_count;
  uint64_t request[VECTOR_COUNT], next_request[VECTOR_COUNT]; /* since when each interrupt is wanted, or NEVER */
  uint16_t stack;                                             /* when the core stopped last */
  uint16_t lowest_stack;
  uint8_t half_written; /* steps for which the stack pointer may be half of an old and half of a new one */
  uint64_t hangs_at;    /* unless it sleeps before */
} avr_recorder;

/* ---- spans ---- */

static void keep_extremes(avr_extremes *e, uint64_t begin, uint64_t net) {
  if (!e->calls || net < e->shortest) e->shortest = net, e->shortest_at = begin;
  if (!e->calls || net > e->longest) e->longest = net, e->longest_at = begin;
  e->calls++;
}

static void keep(avr_recorder *r, const avr_span *span, uint64_t net) {
  if (r->only_extremes) {
    if (span->id >= AVR_FUNCTION_IDS) keep_extremes(&r->extremes[span->id - AVR_FUNCTION_IDS], span->begin, net);
    return;
  }
  r->spans = board_room_for(r->spans, sizeof *r->spans, &r->first, &r->end, &r->capacity, 1);
  r->spans[r->end++] = *span;
}

static void open_one(avr_board *b, uint16_t id, uint64_t begin, uint32_t latency, uint16_t stack) {
  avr_recorder *r = b->recorder;
  if (r->open_count == OPEN_MAXIMUM) {
    crash_at(b, b->core.pc, "more than %u functions and interrupts run in each other", OPEN_MAXIMUM);
    return;
  }
  avr_span span = {.begin = begin, .executed = b->counters.executed_cycles, .latency = latency, .id = id};
  span.depth = (uint16_t)r->open_count;
  r->open[r->open_count++] = (open_span){span, 0, stack};
}

static void close_one(avr_board *b) {
  avr_recorder *r = b->recorder;
  open_span *ended = &r->open[--r->open_count];
  uint64_t gross = b->core.cycle - ended->span.begin;
  ended->span.gross = (uint32_t)gross;
  ended->span.net = (uint32_t)(gross - ended->interrupted);
  keep(r, &ended->span, gross - ended->interrupted);
  if (ended->span.id >= AVR_FUNCTION_IDS) return;
  /* An interrupt below takes it off itself, and hands on what it takes in all. */
  for (unsigned i = r->open_count; i-- > 0;) {
    r->open[i].interrupted += gross;
    if (r->open[i].span.id < AVR_FUNCTION_IDS) break;
  }
}

/* ---- requests of interrupts ---- */

void spans_requested(avr_board *b, uint8_t vector, uint64_t cycle) {
  avr_recorder *r = b->recorder;
  if (!(b->core.raised & b->core.enabled & FLAG(vector))) {
    r->request[vector] = NEVER;
  } else if (r->request[vector] == NEVER) {
    r->request[vector] = cycle;
  } else if (r->next_request[vector] == NEVER) {
    r->next_request[vector] = cycle;
  }
}

void spans_request_gone(avr_board *b, uint8_t vector) {
  b->recorder->request[vector] = b->recorder->next_request[vector] = NEVER;
}

void spans_accept(avr_board *b, uint8_t vector, uint64_t begin) {
  avr_recorder *r = b->recorder;
  uint64_t request = r->request[vector];
  if (vector == VECTOR_USART_RX && request < b->usart.buffer[0].arrived) { /* code has taken the bytes before it */
    request = b->usart.buffer[0].arrived;
  }
  r->request[vector] = r->next_request[vector]; /* of one whose flag stays: what it was raised for again */
  r->next_request[vector] = NEVER;
  r->stack = (uint16_t)(avr_stack(&b->core) - 2u);
  if (r->stack < r->lowest_stack) r->lowest_stack = r->stack;
  open_one(b, vector, begin, request < begin ? (uint32_t)(begin - request) : 0, r->stack);
}

/* ---- where the core stops ---- */

/* Above the highest value of the stack pointer a span has ended; below the lowest one it is lower than ever, or it must
 * not be there. Between them its moves need not be seen. */
static void choose_stops(const avr_board *b) {
  avr_recorder *r = b->recorder;
  uint16_t allowed = (uint16_t)(b->core.stack_floor - 1u);
  uint16_t highest = r->open_count ? r->open[r->open_count - 1].stack : BOARD_DATA_SIZE - 1u;
  r->stops.lowest = r->lowest_stack > allowed ? r->lowest_stack : allowed;
  r->stops.highest = highest < BOARD_DATA_SIZE ? highest : BOARD_DATA_SIZE - 1u;
}

static bool stack_is_whole(avr_board *b, uint32_t address) {
  avr_recorder *r = b->recorder;
  const avr_instruction *i = &b->core.code[address / 2u];
  if (i->kind == OUT && i->k == REG_SPH) r->half_written = HALF_WRITTEN_STEPS;
  if (r->half_written) r->half_written--;
  return r->half_written == 0;
}

static void stack_moved(avr_board *b, uint32_t address) {
  avr_recorder *r = b->recorder;
  if (!stack_is_whole(b, address)) return;
  r->stack = avr_stack(&b->core);
  if (r->stack < r->lowest_stack) r->lowest_stack = r->stack;
  while (r->open_count && r->stack > r->open[r->open_count - 1].stack) close_one(b);
}

static void reached(avr_board *b, uint8_t mark) {
  avr_recorder *r = b->recorder;
  uint16_t id = (uint16_t)(AVR_FUNCTION_IDS + mark - 1u), stack = avr_stack(&b->core);
  const open_span *top = r->open_count ? &r->open[r->open_count - 1] : NULL;
  if (top && top->span.id == id && top->stack == stack) return; /* a loop that goes back to its first instruction */
  open_one(b, id, b->core.cycle, 0, stack);
}

uint32_t run_recorded(avr_board *b, uint64_t until) {
  avr_core *core = &b->core;
  avr_recorder *r = b->recorder;
  uint64_t start = core->cycle;
  if (until > r->hangs_at) until = r->hangs_at;
  if (r->half_written) until = start + 1;
  choose_stops(b);
  uint32_t address = avr_run(core, until, &r->stops), next = core->pc;
  b->counters.executed_cycles += core->cycle - start;
  if (b->crashed || !avr_is_code(&b->core, next)) return address;
  if (avr_stack(core) != r->stack || r->half_written) stack_moved(b, address);
  if (r->stops.marked[next / 2]) reached(b, r->stops.marked[next / 2]);
  if (b->core.sleeping) {
    r->hangs_at = NEVER;
  } else if (core->cycle >= r->hangs_at && !b->crashed) {
    crash_at(b, core->pc, "the program hangs: it has not slept for %llu cycles", (unsigned long long)r->patience);
  }
  return address;
}

static void begin_patience(avr_board *b) {
  avr_recorder *r = b->recorder;
  r->hangs_at = r->patience && !b->core.sleeping ? b->core.cycle + r->patience : NEVER;
}

void spans_woke(avr_board *b) { begin_patience(b); }

void spans_restart(avr_board *b) {
  avr_recorder *r = b->recorder;
  r->open_count = 0; /* cut short: no spans */
  r->stack = (uint16_t)(BOARD_DATA_SIZE - 1u);
  r->half_written = 0;
  begin_patience(b);
  for (size_t i = 0; i < VECTOR_COUNT; i++) r->request[i] = r->next_request[i] = NEVER;
}

/* ---- from outside ---- */

void spans_free(avr_board *b) {
  if (b->recorder) free(b->recorder->spans);
  free(b->recorder);
  b->recorder = NULL;
}

bool avr_board_record(board *self, const avr_watch *watch) {
  avr_board *b = (avr_board *)self;
  if (watch->entry_count > AVR_FUNCTIONS_MAXIMUM) return false;
  avr_recorder *r = calloc(1, sizeof *r);
  if (!r) return false;
  for (size_t i = 0; i < watch->entry_count; i++) {
    if (watch->entries[i] >= AVR_FLASH_SIZE || watch->entries[i] % 2) {
      free(r);
      return false;
    }
    r->stops.marked[watch->entries[i] / 2] = (uint8_t)(i + 1);
  }
  r->patience = watch->patience;
  r->only_extremes = watch->only_extremes;
  r->lowest_stack = avr_stack(&b->core);
  spans_free(b);
  b->recorder = r;
  spans_restart(b);
  r->stack = r->lowest_stack;
  for (uint8_t vector = 1; vector < VECTOR_COUNT; vector++) spans_requested(b, vector, b->core.cycle);
  return true;
}

void avr_board_stop_recording(board *self) { spans_free((avr_board *)self); }

const avr_span *avr_board_spans(const board *self, size_t *count) {
  const avr_recorder *r = ((const avr_board *)self)->recorder;
  *count = r ? r->end : 0;
  return r ? r->spans : NULL;
}

void avr_board_forget_spans(board *self) {
  avr_recorder *r = ((avr_board *)self)->recorder;
  if (r) r->end = 0;
}

const avr_extremes *avr_board_extremes(const board *self) {
  const avr_recorder *r = ((const avr_board *)self)->recorder;
  return r && r->only_extremes ? r->extremes : NULL;
}

uint16_t avr_board_lowest_stack(const board *self) {
  const avr_recorder *r = ((const avr_board *)self)->recorder;
  return r ? r->lowest_stack : 0;
}
