/* buzzer.c: see buzzer.h. */
#include "buzzer.h"

#include <math.h>

#define PERIOD_MAXIMUM (BOARD_CLOCK_HZ / 20u) /* below 20 Hz there are clicks, no tone */

#define PERIODS_MINIMUM 2u /* one alone is the pause between two tones */

static void begin_tone(buzzer *self, uint64_t begin, uint64_t cycles, uint32_t periods) {
  self->begin = begin;
  self->periods = periods;
  self->sum = cycles;
  self->period = cycles / periods;
  self->odd = 0;
}

static void end_tone(buzzer *self, uint64_t end) {
  if (self->periods >= PERIODS_MINIMUM) {
    const sim_tone tone = {
        .time = (double)self->begin / BOARD_CLOCK_HZ,
        .duration = (double)(end - self->begin) / BOARD_CLOCK_HZ,
        .frequency = BOARD_CLOCK_HZ * (double)self->periods / (double)self->sum,
    };
    buffer_append(self->part.chassis->tones, &tone, sizeof tone);
  }
  self->periods = 0;
}

static int is_like(uint64_t period, uint64_t other) {
  return fabs((double)period - (double)other) <= BUZZER_LIKENESS * (double)other;
}

/* A period unlike the tone's has an edge that came late, or is the first one of another pitch. It is another pitch if
 * the next period is like it. */
static void on_rise(buzzer *self, uint64_t cycle) {
  const uint64_t period = cycle - self->rise;
  if (self->periods > 0 && is_like(period, self->period)) {
    self->periods++;
    self->sum += period;
    self->odd = 0;
  } else if (period > PERIOD_MAXIMUM) {
    end_tone(self, self->fall);
  } else if (self->periods < PERIODS_MINIMUM) {
    begin_tone(self, self->rise, period, 1);
  } else if (self->odd != 0 && is_like(period, self->odd)) {
    const uint64_t change = self->rise - self->odd;
    end_tone(self, change);
    begin_tone(self, change, self->odd + period, 2);
  } else {
    self->odd = period;
  }
  self->rise = cycle;
}

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  buzzer *self = (buzzer *)base;
  const uint8_t high = level == BOARD_HIGH;
  if (high == self->high) return;
  self->high = high;
  if (high) {
    on_rise(self, cycle);
  } else {
    self->fall = cycle;
  }
}

/* Silence since: boards have run up to the beginning of the step. */
static void step(part *base) {
  buzzer *self = (buzzer *)base;
  if (self->periods > 0 && base->chassis->since > self->rise + 2 * self->period) end_tone(self, self->fall);
}

static const part_operations OPERATIONS = {.edge = edge, .step = step};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  part_join(base, &OPERATIONS, place, &(part_pin){pins[0], PART_HEARS}, 1);
  return 0;
}

const part_kind buzzer_kind = {.size = sizeof(buzzer), .noise = 86, .pins = 1, .init = init};
