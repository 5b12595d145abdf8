/* own_spi.c: see own_spi.h. */
#include "own_spi.h"

enum { CPHA = 1, CPOL = 2 };

struct own_spi {
  part part;
  own_spi_parameters asked;
  int mode; /* -1: none is selected */
  uint8_t mosi, clock;
  uint8_t sent, got, bit; /* the bytes under way, and how many bits of them are over */
};

static void put(own_spi *self, uint64_t cycle) {
  const int bit = self->sent >> (7 - self->bit) & 1;
  part_drive(&self->part, cycle, self->part.pins[0].pin, bit ? BOARD_HIGH : BOARD_LOW);
}

void own_spi_select(own_spi *self, int mode, uint8_t first, uint64_t cycle) {
  self->mode = mode;
  self->sent = first;
  self->got = self->bit = 0;
  if (mode < 0) {
    part_drive(&self->part, cycle, self->part.pins[0].pin, BOARD_RELEASED);
  } else if (!(mode & CPHA)) {
    put(self, cycle);
  }
}

/* By one edge of the clock a bit is put on the line, by the other one it is read (table 19-2). */
static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  own_spi *self = (own_spi *)base;
  const uint8_t high = level == BOARD_HIGH, clocks = pin == base->pins[2].pin;
  uint8_t *line = clocks ? &self->clock : &self->mosi;
  const int moves = *line != high;
  *line = high;
  if (!moves || !clocks || self->mode < 0) return;
  const int leads = high != (self->mode & CPOL) / CPOL;
  if (leads == (self->mode & CPHA)) {
    put(self, cycle);
    return;
  }
  self->got = (uint8_t)(self->got << 1 | self->mosi);
  if (++self->bit < 8) return;
  self->bit = 0;
  self->sent = (uint8_t)self->asked.answer(self->asked.context, self->got, cycle);
}

static const part_operations OPERATIONS = {.edge = edge};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  own_spi *self = (own_spi *)base;
  part_join(base, &OPERATIONS, place,
            (part_pin[]){{pins[0], PART_DRIVES | PART_OPENS}, {pins[1], PART_HEARS}, {pins[2], PART_HEARS}}, 3);
  self->asked = *(const own_spi_parameters *)parameters;
  *self->asked.made = self;
  self->mode = -1;
  return 0;
}

const part_kind own_spi_kind = {.size = sizeof(own_spi), .noise = 0, .pins = 3, .init = init};
