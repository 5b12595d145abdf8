/* board.h: one emulated board, whatever emulates it.
 *
 * A board runs firmware on a 16 MHz clock, has the Arduino Uno's pins and one serial line. Everybody outside (loop,
 * parts, tests, the Python face) sees it through these operations only; boards/avr and boards/native implement them.
 *
 * Time is in CPU cycles since power-on and never goes back, not even at a reset. Stamps and bytes do not depend on how
 * a run is cut into calls of `advance`.
 */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define BOARD_CLOCK_HZ 16000000u
#define BOARD_PIN_COUNT 20u /* Arduino numbers: 0..13, then A0..A5 as 14..19 */
#define BOARD_FIRST_ANALOG_PIN 14u
#define BOARD_ANALOG_COUNT 6u
#define BOARD_INTERFACE_VERSION 3u
#define BOARD_GUARD_CYCLES 64u

#define BOARD_NOMINAL_VOLTS 5.0
#define BOARD_ANALOG_SUPPLY 128u /* not a pin: the voltage at VCC and AVCC */
#define BOARD_BAND_GAP_VOLTS 1.1 /* the chip's own reference (data sheet of the ATmega328P, 11.7) */

/* What the firmware does to a pin, and what the outside may do to it (the first three only). */
enum { BOARD_LOW = 0, BOARD_HIGH = 1, BOARD_RELEASED = 2, BOARD_PULLED_UP = 3 };

/* python: begin */
typedef enum { BOARD_RESET_POWER, BOARD_RESET_EXTERNAL, BOARD_RESET_BROWN_OUT, BOARD_RESET_WATCHDOG } board_reset_cause;

typedef enum {
  BOARD_RUNNING = 0,
  BOARD_CRASHED = 1, /* the program cannot go on; see `fault` */
  BOARD_STOPPED = 2, /* a debugger has ended the run */
  BOARD_PAUSED = 3   /* an edge has; the next `advance` goes on from there */
} board_state;

typedef struct {
  uint64_t executed_cycles; /* cycles in which the CPU executed instructions or entered interrupts; 0 if not known */
  uint64_t interrupts;
  uint64_t bytes_in;  /* bytes whose stop bit reached the board */
  uint64_t bytes_out; /* bytes whose stop bit left the board */
  uint64_t overruns;  /* received bytes lost because the receiver was full (DOR0) */
  uint64_t framing_errors;
  uint64_t resets; /* since power-on */
  uint64_t edges_out;
} board_counters;

typedef struct board board;

/* Called from inside `advance` at the very cycle at which the firmware changes what it does to a pin (LOW, HIGH, RELEASED,
 * PULLED_UP); at a reset for each pin that changes. Whoever owns the board owns the sink and hands edges on. */
typedef void board_edge_sink(void *context, uint64_t cycle, uint8_t pin, uint8_t level);

/* Called behind the sink, for the pins that it was asked for (`reacts`). It may do all that a sink may: drive pins, send bytes,
 * ask for a reset. Not 0: the run ends here. */
typedef int board_reaction(void *context, uint64_t cycle, uint8_t pin, uint8_t level);

/* The voltage at analog channel 0..5, or at BOARD_ANALOG_SUPPLY; 0 for what the source does not know. */
typedef double board_analog_source(void *context, uint64_t cycle, uint8_t channel);

/* An edge as logs keep it; `level`: LOW, HIGH, RELEASED, PULLED_UP. */
typedef struct {
  uint64_t cycle;
  uint8_t pin;
  uint8_t level;
  uint8_t unused[6];
} board_edge;
/* python: end */

/* What `extension` may offer under these names. */
#define BOARD_DATA "data" /* uint8_t[BOARD_DATA_SIZE]: data space of an AVR, I/O registers as last written */
#define BOARD_DATA_SIZE 0x0900u
#define BOARD_EEPROM "eeprom" /* a board_eeprom */
#define BOARD_EEPROM_SIZE 1024u

/* uint32_t: byte address in flash of the instruction that crashed the board; NULL: it has not crashed, or nobody knows. */
#define BOARD_FAULT_ADDRESS "fault address"
#define BOARD_PROGRAM_COUNTER "program counter" /* uint32_t: byte address of the next instruction */

#define BOARD_WATCHDOG_LOG "watchdog log" /* a board_watchdog_log */

#define BOARD_NOTES "notes" /* a board_notes */

#define BOARD_PIN_LEVELS "pin levels" /* uint8_t[BOARD_PIN_COUNT]: 0 or 1, as the program would read them now */
#define BOARD_CHECKS "checks"         /* a board_checks */

#define BOARD_OUTSIDE_LOG "outside log" /* a board_outside_log */

/* double: by which share the rate of an outside that follows the board's is off, from the next `line_rate` on. */
#define BOARD_LINE_OFF "line off"

/* python: begin */
enum { BOARD_NOTES_MAXIMUM = 64 };

/* Something that the program asked for and did not get, because it is not built or the chip does not give it so, or
 * something legal that is seldom meant: once per run, where it happened first. */
typedef struct {
  uint64_t cycle;
  uint32_t address; /* byte address in flash of the instruction */
  const char *does, *what, *why;
} board_note;

typedef struct {
  board_note notes[BOARD_NOTES_MAXIMUM]; /* oldest first */
  size_t count;
} board_notes;

/* What a program is checked by while it runs, off at first: who joins something to the board's pins says what, by bits of
 * Arduino's numbers. */
typedef struct {
  bool on, strict;
  uint32_t joined;     /* something is there */
  uint32_t analog;     /* a voltage that only the converter reads */
  uint32_t pulls_low;  /* and pulls it low harder than a resistor does, when it drives it low */
  uint32_t pulls_high; /* the same for high */
} board_checks;

/* What a cell of the EEPROM holds after the supply failed while it was being written. */
typedef enum {
  BOARD_DAMAGE_ERASED, /* 0xFF */
  BOARD_DAMAGE_OLD,    /* what it held before */
  BOARD_DAMAGE_NEW,    /* what it was to hold */
  BOARD_DAMAGE_GARBAGE /* whatever the test says */
} board_damage;

typedef struct {
  uint8_t *bytes; /* BOARD_EEPROM_SIZE; a cell changes when its write is complete */
  board_damage damage;
  uint8_t garbage;
} board_eeprom;

/* Where the program was that the board's own watchdog reset: byte address in flash of the instruction that was next, and
 * the cycle of that. With a watchdog that warns by an interrupt: when that came; what runs behind it does not show who
 * hung. */
typedef struct {
  uint64_t cycle;
  uint32_t address;
} board_watchdog_reset;

typedef struct {
  board_watchdog_reset *resets; /* oldest first, to `end` */
  size_t first, end, capacity;
} board_watchdog_log;

/* A frame on the serial line: a start bit, eight data bits, the least significant first, then the line is high. Times are
 * in cycles << 16. */
typedef struct {
  uint64_t start, bit_time;
  uint8_t bits; /* the stop bit included */
  uint8_t byte;
  uint8_t unused[6];
} board_frame;

/* What the outside does to the pins, edge by edge, and what is on the line to the board and from it; while it is on. Who
 * takes what is there sets `first` to `end`. */
typedef struct {
  bool on;
  struct board_edges {
    board_edge *items;
    size_t first, end, capacity;
  } driven;
  struct board_frames {
    board_frame *items;
    size_t first, end, capacity;
  } to_board, from_board;
  board_edge_sink *heard; /* not NULL: called at the cycle at which the outside changes what it does to a pin */
  void *heard_context;
} board_outside_log;

typedef struct {
  uint32_t version; /* BOARD_INTERFACE_VERSION */
  const char *kind; /* "avr" or "native" */

  /* Frees the board. */
  void (*destroy)(board *self);

  /* The cycle up to which the board has run. */
  uint64_t (*now)(const board *self);

  /* Runs until `now` >= `until` (an instruction is never split), or behind the instruction, of a native board the event,
   * in which an edge ends the run (`stops`, a reaction). */
  board_state (*advance)(board *self, uint64_t until);

  /* From cycle `at` on the outside drives `pin` to LOW, HIGH, or RELEASED. Replaces what was queued for that pin at or
   * after `at`. May be called from a sink. `at` in the past means now: runs are independent of how they are cut when
   * edges are queued at least BOARD_GUARD_CYCLES ahead of `until`. */
  void (*drive)(board *self, uint64_t at, uint8_t pin, uint8_t level);

  /* What the firmware does to the pin now: LOW, HIGH, RELEASED, PULLED_UP. */
  uint8_t (*output)(const board *self, uint8_t pin);

  /* Who is asked for the voltage at an analog channel when the converter samples it; NULL: 0 V at the pins and the
   * nominal supply. */
  void (*analog)(board *self, board_analog_source *source, void *context);

  /* Puts bytes on the line towards the board, back to back, the first start bit not before cycle `at`. */
  void (*send)(board *self, uint64_t at, const uint8_t *bytes, size_t count);

  /* Takes bytes that left the board (their stop bit has ended); `cycles`, if not NULL, gets the cycle of each one's
   * end. Returns how many, at most `capacity`. */
  size_t (*receive)(board *self, uint8_t *bytes, uint64_t *cycles, size_t capacity);

  /* Bit rate of the outside's side of the line, default 500,000. 0: always the board's own, as its registers say;
   * emulated ATmega328P only. */
  void (*line_rate)(board *self, uint32_t baud);

  /* Resets the microcontroller at its next instruction. Time and what drives its pins from outside stay; POWER also
   * loses RAM. Bytes in flight are lost. A write to the EEPROM that is under way is completed, but at POWER and BROWN_OUT
   * its cell is damaged. */
  void (*reset)(board *self, board_reset_cause cause);

  /* Holds the microcontroller in brown-out reset or lets it go: held it executes nothing and lets go of its pins, but time
   * passes; then the program begins anew. */
  void (*hold)(board *self, bool held);

  void (*counters)(const board *self, board_counters *out);

  /* One sentence about a crash, or NULL. */
  const char *(*fault)(const board *self);

  /* What only one kind of board offers, by name, or NULL. */
  void *(*extension)(board *self, const char *name);
} board_operations;

struct board {
  const board_operations *op;
  board_edge_sink *sink; /* NULL: nobody listens */
  void *sink_context;
  uint32_t reacts; /* pins, by bits of Arduino's numbers, whose edges call `react`; */
  uint32_t stops;  /* whose edges end the run, those that the outside drives too where it is seen (BOARD_OUTSIDE_LOG) */
  board_reaction *react;
  void *react_context;
  bool paused; /* an edge ends the run, which does not know it yet */
};
/* python: end */

static inline bool board_stops_at(board *b, uint8_t pin) {
  if (b->stops >> pin & 1u) b->paused = true;
  return b->paused;
}

/* What each kind of board calls at each edge. True: its run is to end behind the instruction at hand. */
static inline bool board_show_edge(board *b, uint64_t cycle, uint8_t pin, uint8_t level) {
  if (b->sink) b->sink(b->sink_context, cycle, pin, level);
  if (__builtin_expect(!((b->reacts | b->stops) >> pin & 1u), true)) return false;
  if ((b->reacts >> pin & 1u) && b->react(b->react_context, cycle, pin, level)) b->paused = true;
  return board_stops_at(b, pin);
}

static inline bool board_takes_pause(board *b) {
  const bool paused = b->paused;
  b->paused = false;
  return paused;
}

/* The supply as a source gives it. */
static inline double board_supply_volts(board_analog_source *source, void *context, uint64_t cycle) {
  const double volts = source ? source(context, cycle, BOARD_ANALOG_SUPPLY) : 0.0;
  return volts > 0.0 ? volts : BOARD_NOMINAL_VOLTS;
}

/* What a cell holds whose write from `before` to `after` was cut short. */
static inline uint8_t board_damaged_cell(const board_eeprom *eeprom, uint8_t before, uint8_t after) {
  switch (eeprom->damage) {
    case BOARD_DAMAGE_OLD:
      return before;
    case BOARD_DAMAGE_NEW:
      return after;
    case BOARD_DAMAGE_GARBAGE:
      return eeprom->garbage;
    case BOARD_DAMAGE_ERASED:
    default:
      return 0xFF;
  }
}

#endif
