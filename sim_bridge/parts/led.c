/* led.c: see led.h. */
#include "led.h"

#define PULL_UP_OHM 35e3
#define NOMINAL_OHM 220.0

typedef struct {
  part part;
  led_parameters parameters;
  uint8_t level;  /* what the board does to the pin */
  double lit;     /* brightness times cycles, since it was last asked */
  uint64_t since; /* up to there */
  uint64_t begin; /* when it was last asked */
} led;

/* Its brightness now. */
static double brightness(const led *self) {
  const led_parameters *p = &self->parameters;
  const double volts = self->part.chassis->supply * BOARD_NOMINAL_VOLTS - p->forward_v;
  if (volts <= 0.0 || self->part.unplugged) return 0.0;
  double ohm = p->ohm;
  if (!p->to_supply && self->level == BOARD_PULLED_UP) {
    ohm += PULL_UP_OHM;
  } else if (self->level != (p->to_supply ? BOARD_LOW : BOARD_HIGH)) {
    return 0.0;
  }
  return p->brightness * (volts / ohm) / ((BOARD_NOMINAL_VOLTS - p->forward_v) / NOMINAL_OHM);
}

static void pass(led *self, uint64_t cycle) {
  if (cycle <= self->since) return;
  self->lit += brightness(self) * (double)(cycle - self->since);
  self->since = cycle;
}

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  led *self = (led *)base;
  pass(self, cycle);
  self->level = level;
}

static int read(part *base, double *values) {
  led *self = (led *)base;
  pass(self, base->chassis->board->op->now(base->chassis->board));
  *values = self->since > self->begin ? self->lit / (double)(self->since - self->begin) : brightness(self);
  self->lit = 0.0;
  self->begin = self->since;
  return 1;
}

static const part_operations OPERATIONS = {.edge = edge, .read = read};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  led *self = (led *)base;
  self->parameters = *(const led_parameters *)parameters;
  self->level = BOARD_RELEASED;
  if (!(self->parameters.ohm > 0.0)) return -1;
  part_join(base, &OPERATIONS, place, &(part_pin){pins[0], PART_HEARS}, 1);
  return 0;
}

const part_kind led_kind = {.size = sizeof(led), .noise = 260, .pins = 1, .init = init};
