/* avr_checks.c: see avr_checks.h.
 *
 * What stands at a pin the board does not know: who joins parts to it says it (board_checks of board.h).
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#include "avr_checks.h"

#include <stdlib.h>

#include "avr_instructions.h"
#include "avr_opcodes.h"
#include "avr_parts.h"

#define LOOKAHEAD 4 /* instructions from the reading of a port to what takes one bit of it */

static const char *const PINS[BOARD_PIN_COUNT] = {
    "pin 0",  "pin 1",  "pin 2",  "pin 3",  "pin 4", "pin 5", "pin 6", "pin 7", "pin 8", "pin 9",
    "pin 10", "pin 11", "pin 12", "pin 13", "A0",    "A1",    "A2",    "A3",    "A4",    "A5",
};

static bool is_set(uint32_t pins, uint8_t pin) { return pins >> pin & 1u; }

/* The instruction under way, or the next one. */
static uint32_t here(const avr_board *b) { return (uint32_t)b->avr->pc; }

static void found(avr_board *b, const char *does, const char *what, const char *why) {
  if (b->checks.strict) {
    if (!b->crashed) crash_at(b, here(b), "the program %s %s (%s)", does, what, why);
  } else {
    note_place(b, here(b), does, what, why);
  }
}

/* ---- pins ---- */

void check_driven(avr_board *b, uint8_t pin, bool high) {
  if (!is_set(high ? b->checks.pulls_low : b->checks.pulls_high, pin)) return;
  found(b, "drives", PINS[pin], high ? "what is joined there pulls it low" : "what is joined there pulls it high");
}

static void check_input(avr_board *b, uint8_t pin, const char *does) {
  const bool is_analog = is_set(b->checks.analog, pin);
  if (!pin_floats(b, pin) || (is_set(b->checks.joined, pin) && !is_analog)) return;
  found(b, does, PINS[pin],
        is_analog ? "a voltage is there, which is emulated for the ADC only: it reads low"
                  : "nothing drives it and its pull-up is off: it is anything");
}

void check_analog(avr_board *b, uint8_t channel) {
  const uint8_t pin = (uint8_t)(BOARD_FIRST_ANALOG_PIN + channel);
  if (!b->checks.on || channel >= BOARD_ANALOG_COUNT || is_set(b->checks.analog, pin)) return;
  check_input(b, pin, "converts the voltage at");
}

void check_watched(avr_board *b, uint8_t port, uint8_t mask) {
  for (uint8_t bit = 0; b->checks.on && bit < 8; bit++) {
    const uint8_t pin = pin_of(port, bit);
    if ((mask >> bit & 1u) && pin < BOARD_PIN_COUNT) check_input(b, pin, "has an interrupt at");
  }
}

/* The bits that the program looks at of the port that the instruction at `pc` reads: by SBIC and SBIS one; else those
 * that one of the next instructions picks out. 0: not known, as of a port that is kept whole. */
static uint8_t bits_of_interest(const avr_board *b) {
  const uint8_t *flash = b->avr->flash, *data = b->avr->data;
  uint32_t pc = here(b);
  unsigned opcode = word_of(flash, pc), changed = 0;
  if ((opcode & 0xFD00u) == 0x9900u) return (uint8_t)(1u << (opcode & 7u));
  const unsigned port = opcode >> 4 & 0x1Fu;
  for (int i = 0; i < LOOKAHEAD; i++) {
    pc += is_two_words(opcode) ? 4 : 2;
    if (pc >= AVR_BOARD_FLASH_SIZE) return 0;
    opcode = word_of(flash, pc);
    const unsigned kind = avr_kinds[opcode], d = opcode >> 4 & 0x1Fu, r = (opcode >> 5 & 0x10u) | (opcode & 0xFu);
    const unsigned h = (opcode >> 4 & 0xFu) + 16u;
    if (kind == AND && (d == port || r == port) && d != r) {
      const unsigned mask = d == port ? r : d;
      return changed >> mask & 1u ? 0 : data[mask];
    }
    if (kind == ANDI && h == port) return (uint8_t)((opcode >> 4 & 0xF0u) | (opcode & 0xFu));
    if ((kind == SKIP_CLEAR || kind == SKIP_SET || kind == BST) && d == port) return (uint8_t)(1u << (opcode & 7u));
    if (kind != LDI || h == port) return 0;
    changed |= 1u << h;
  }
  return 0;
}

void check_read(avr_board *b, uint8_t port) {
  const uint8_t bits = bits_of_interest(b);
  for (uint8_t bit = 0; bit < 8; bit++) {
    const uint8_t pin = pin_of(port, bit);
    if ((bits >> bit & 1u) && pin < BOARD_PIN_COUNT) check_input(b, pin, "decides by");
  }
}

/* ---- RAM ---- */

void check_access(avr_board *b) {
  const data_access access = next_access(b);
  for (unsigned i = 0; i < access.count; i++) {
    const unsigned cell = access.first + i;
    if (cell < RAM_BEGIN || cell >= BOARD_DATA_SIZE || b->written[cell]) continue;
    if (!access.writes) found(b, "reads", "RAM that was never written", "it is anything since the power came");
    b->written[cell] = 1;
  }
}

/* ---- from outside ---- */

bool avr_board_check(board *self, bool strict) {
  avr_board *b = (avr_board *)self;
  if (!b->written) b->written = calloc(1, BOARD_DATA_SIZE);
  if (!b->written) return false;
  b->checks.on = true;
  b->checks.joined |= 3u; /* the serial line */
  b->checks.strict = strict;
  return true;
}
