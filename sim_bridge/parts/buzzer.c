/* buzzer.c: see buzzer.h. */
#include "buzzer.h"

#define PERIOD_MAXIMUM (BOARD_CLOCK_HZ / 20u) /* below 20 Hz there are clicks, no tone */

#define PERIODS_MINIMUM 2u /* one alone is the pause between two tones */

/* The tone under way has ended with the period that began at the last rise. */
static void end_tone(buzzer *self) {
  if (self->periods >= PERIODS_MINIMUM) {
    const double period = (double)(self->rise - self->begin) / self->periods;
    const sim_tone tone = {
        .time = (double)self->begin / BOARD_CLOCK_HZ,
        .duration = (double)(self->fall - self->begin) / BOARD_CLOCK_HZ,
        .frequency = BOARD_CLOCK_HZ / period,
    };
    buffer_append(self->part.chassis->tones, &tone, sizeof tone);
  }
  self->periods = 0;
}

static int is_like(const buzzer *self, uint64_t period) {
  const double difference = (double)period - (double)self->period;
  return difference <= BUZZER_LIKENESS * (double)self->period && -difference <= BUZZER_LIKENESS * (double)self->period;
}

static void on_rise(buzzer *self, uint64_t cycle) {
  const uint64_t period = cycle - self->rise;
  if (self->periods > 0 && is_like(self, period)) {
    self->periods++;
  } else {
    end_tone(self);
    if (period <= PERIOD_MAXIMUM) {
      self->begin = self->rise;
      self->period = period;
      self->periods = 1;
    }
  }
  self->rise = cycle;
}

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  buzzer *self = (buzzer *)base;
  (void)pin;
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
  if (self->periods > 0 && base->chassis->since > self->rise + 2 * self->period) end_tone(self);
}

static const part_operations OPERATIONS = {.edge = edge, .step = step};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  (void)parameters;
  part_join(base, &OPERATIONS, place, &(part_pin){pins[0], PART_HEARS}, 1);
  return 0;
}

static const part_kind KIND = {.size = sizeof(buzzer), .noise = 86, .pins = 1, .init = init};
const part_kind *const buzzer_kind = &KIND;
