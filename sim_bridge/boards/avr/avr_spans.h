/* avr_spans.h: a recorder of what an untouched program does in time: the span of every interrupt and of chosen
 * functions, the depth of its stack, and where it goes wrong. Off until `avr_board_record`, and then free.
 *
 * While it records, the core stops where a watched function begins and where the stack pointer leaves the range in
 * which nothing ends and nothing is new; cycles, edges and bytes are the same as without it. An interrupt's span begins
 * with the first of its four entry cycles, a function's with its first instruction; each ends with the instruction that
 * takes the return address off the stack.
 */
#ifndef AVR_SPANS_H
#define AVR_SPANS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../board.h"

/* python: begin */
enum { AVR_FUNCTION_IDS = 64 }; /* id of the first watched function; below are vectors */
enum { AVR_FUNCTIONS_MAXIMUM = 128 };

typedef struct {
  uint64_t begin;    /* cycle */
  uint64_t executed; /* cycles in which the CPU had executed something, before it */
  uint32_t gross;    /* cycles */
  uint32_t net;      /* the same without interrupts that came in between */
  uint32_t latency;  /* of an interrupt: cycles from its request to `begin` */
  uint16_t id;       /* vector, or AVR_FUNCTION_IDS + index of the function */
  uint16_t depth;    /* spans that it came into */
} avr_span;

/* Of all calls of a function that have ended. */
typedef struct {
  uint64_t calls;
  uint64_t shortest, longest;       /* net cycles */
  uint64_t shortest_at, longest_at; /* cycle at which the first one of that length began */
} avr_extremes;

typedef struct {
  const uint32_t *entries; /* byte addresses of functions */
  size_t entry_count;
  uint64_t patience;  /* cycles without sleep after which the program hangs; 0: any number */
  bool only_extremes; /* of functions, and no list of spans: however long it runs, it takes no memory */
} avr_watch;

/* Begins to record, anew if it did already. False: no memory, or an entry that is no address of flash. */
bool avr_board_record(board *self, const avr_watch *watch);
void avr_board_stop_recording(board *self);

/* Spans that have ended, in the order of their ends; valid until the board runs on. */
const avr_span *avr_board_spans(const board *self, size_t *count);
void avr_board_forget_spans(board *self);

/* Of each function of the watch, in its order; NULL: they are not kept. */
const avr_extremes *avr_board_extremes(const board *self);

/* Lowest value of the stack pointer while it records. */
uint16_t avr_board_lowest_stack(const board *self);
/* python: end */

#endif
