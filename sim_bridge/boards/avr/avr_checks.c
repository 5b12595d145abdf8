/* avr_checks.c: see avr_checks.h.
 *
 * What stands at a pin the board does not know: who joins parts to it says it (board_checks of board.h).
 */
#include "avr_checks.h"

#include <stdlib.h>

#include "avr_parts.h"
#include "core/avr_decode.h"

#define LOOKAHEAD 4 /* instructions from the reading of a port to what takes one bit of it */

static const char *const PINS[BOARD_PIN_COUNT] = {
    "pin 0",  "pin 1",  "pin 2",  "pin 3",  "pin 4", "pin 5", "pin 6", "pin 7", "pin 8", "pin 9",
    "pin 10", "pin 11", "pin 12", "pin 13", "A0",    "A1",    "A2",    "A3",    "A4",    "A5",
};

static bool is_set(uint32_t pins, uint8_t pin) { return pins >> pin & 1u; }

/* The instruction under way, or the next one. */
static uint32_t here(const avr_board *b) { return b->core.pc; }

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
  const avr_instruction *i = &b->core.code[here(b) / 2u];
  if (i->kind == SBIC || i->kind == SBIS) return i->d;
  const uint8_t port = i->d;
  uint32_t changed = 0;
  for (int n = 0; n < LOOKAHEAD; n++) {
    i += avr_has_two_words(i->kind) ? 2 : 1;
    if (i - b->core.code >= AVR_FLASH_SIZE / 2) return 0;
    if (i->kind == AND && (i->d == port || i->k == port) && i->d != i->k) {
      const unsigned mask = i->d == port ? i->k : i->d;
      return changed >> mask & 1u ? 0 : b->core.data[mask];
    }
    if (i->kind == ANDI && i->d == port) return (uint8_t)i->k;
    if ((i->kind == SBRC || i->kind == SBRS || i->kind == BST) && i->d == port) return (uint8_t)i->k;
    if (i->kind != LDI || i->d == port) return 0;
    changed |= UINT32_C(1) << i->d;
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

void check_never_written(avr_board *b) {
  found(b, "reads", "RAM that was never written", "it is anything since the power came");
  if (b->crashed) avr_stop(&b->core);
}

/* ---- from outside ---- */

bool avr_board_check(board *self, bool strict) {
  avr_board *b = (avr_board *)self;
  if (!b->core.written) b->core.written = calloc(1, BOARD_DATA_SIZE);
  if (!b->core.written) return false;
  b->checks.on = true;
  b->checks.joined |= 3u; /* the serial line */
  b->checks.strict = strict;
  return true;
}
