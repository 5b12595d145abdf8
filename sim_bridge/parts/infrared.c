/* infrared.c: see infrared.h. */
#include "infrared.h"

#define PERIOD_MINIMUM 360.0 /* 44.4 kHz */
#define PERIOD_MAXIMUM 480.0 /* 33.3 kHz */
#define GAP 800u             /* longer: a new train */
#define CYCLES_TO_HEAR INFRARED_CYCLES_TO_HEAR
#define CYCLES_TO_SETTLE INFRARED_CYCLES_TO_SETTLE
#define HOLD_CYCLES (10u * 421u) /* the output stays low for ten periods after the last one */

static void forget_past_light(infrared *self, uint64_t cycle) {
  int kept = 0;
  for (int i = 0; i < self->foreign_count; i++) {
    if (self->foreign[i].until > cycle) self->foreign[kept++] = self->foreign[i];
  }
  self->foreign_count = kept;
}

/* Queues the output from `cycle` on: low while any light lasts, the own burst's until `lit_until`. */
static void drive_output(infrared *self, uint64_t cycle) {
  forget_past_light(self, cycle);
  uint64_t low_until = self->lit_until;
  const int lit = low_until > cycle;
  if (lit) part_drive(&self->part, cycle, self->part.pins[1].pin, BOARD_LOW);
  int low = lit;
  for (int i = 0; i < self->foreign_count; i++) {
    const infrared_light *light = &self->foreign[i];
    if (low && light->from > low_until) {
      part_drive(&self->part, low_until, self->part.pins[1].pin, BOARD_HIGH);
      low = 0;
    }
    if (!low) part_drive(&self->part, light->from > cycle ? light->from : cycle, self->part.pins[1].pin, BOARD_LOW);
    if (!low || light->until > low_until) low_until = light->until;
    low = 1;
  }
  if (low) part_drive(&self->part, low_until, self->part.pins[1].pin, BOARD_HIGH);
}

static double frequency_of(double period) { return (double)BOARD_CLOCK_HZ / period; }

/* The mean period of the last cycles: from the mean of the first half of their rises to that of the second half. */
static double mean_period(const infrared *self) {
  const uint32_t all = self->carrier_cycles + 1;
  const uint32_t rises = all < CYCLES_TO_SETTLE ? all : CYCLES_TO_SETTLE;
  const uint32_t half = rises / 2;
  uint64_t sum = 0;
  for (uint32_t i = 0; i < half; i++) {
    sum += self->rises[(all - half + i) % CYCLES_TO_SETTLE] - self->rises[(all - rises + i) % CYCLES_TO_SETTLE];
  }
  return (double)sum / (double)(half * (rises - half));
}

static void look(infrared *self, uint64_t cycle, noise_source *noise) {
  const viewpoint from = part_view(&self->part, cycle);
  self->seen = (uint8_t)infrared_pair_look(&self->pair, &from, frequency_of(self->period), noise).seen;
}

/* The first rise of a train. */
static void begin(infrared *self, uint64_t cycle) {
  self->carrier_cycles = 0;
  self->rises[0] = cycle;
  self->seen = 0;
}

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  infrared *self = (infrared *)base;
  if (level != BOARD_HIGH) return;
  const int is_new = cycle - self->last_rise > GAP;
  self->last_rise = cycle;
  if (is_new) {
    begin(self, cycle);
    return;
  }
  self->carrier_cycles++;
  self->rises[self->carrier_cycles % CYCLES_TO_SETTLE] = cycle;
  if (self->carrier_cycles < CYCLES_TO_HEAR) return;
  self->period = mean_period(self);
  if (self->period < PERIOD_MINIMUM || self->period > PERIOD_MAXIMUM) {
    begin(self, cycle);
    return;
  }
  if (self->carrier_cycles == CYCLES_TO_HEAR) {
    self->drawn = self->part.noise;
    look(self, cycle, &self->part.noise);
  } else if (self->carrier_cycles == CYCLES_TO_SETTLE) {
    look(self, cycle, &self->drawn);
  }
  if (self->sent_from == self->sent_until) self->sent_from = cycle;
  self->sent_until = cycle + 1;
  if (self->seen) { /* low from now on takes back the end that was queued a period ago */
    self->lit_until = cycle + HOLD_CYCLES;
    drive_output(self, cycle);
  }
}

static void hold(const part *base, fault *f) {
  f->pin = base->pins[1].pin;
  f->level = BOARD_LOW;
}

static const part_operations OPERATIONS = {.edge = edge, .hold = hold};

infrared *infrared_of(part *base) { return base->op == &OPERATIONS ? (infrared *)base : NULL; }

int infrared_take_burst(infrared *self, infrared_burst *burst, infrared_light *span) {
  if (self->sent_from == self->sent_until) return 0;
  const viewpoint from = part_view(&self->part, self->sent_from);
  *burst = infrared_pair_burst(&self->pair, &from, frequency_of(self->period));
  *span = (infrared_light){self->sent_from, self->sent_until};
  self->sent_from = self->sent_until;
  return 1;
}

void infrared_see_burst(infrared *self, const infrared_burst *burst, const infrared_light *span) {
  if (self->part.overridden || self->part.unplugged || !(self->pair.direct > 0.0)) return;
  const viewpoint from = part_view(&self->part, span->from);
  if (!infrared_pair_sees_burst(&self->pair, &from, burst)) return;
  infrared_light light = {span->from, span->until + HOLD_CYCLES};
  int i = self->foreign_count;
  if (i == INFRARED_FOREIGN) return; /* it is lit without a pause anyway */
  for (; i > 0 && self->foreign[i - 1].from > light.from; i--) self->foreign[i] = self->foreign[i - 1];
  self->foreign[i] = light;
  self->foreign_count++;
  drive_output(self, light.from);
}

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  infrared *self = (infrared *)base;
  if (pins[1] == PART_NO_PIN || infrared_pair_init(&self->pair, parameters) != 0) return -1;
  part_join(base, &OPERATIONS, place, (part_pin[]){{pins[0], PART_HEARS}, {pins[1], PART_DRIVES | PART_PULLED_UP}}, 2);
  part_drive(base, 0, pins[1], BOARD_HIGH);
  return 0;
}

const part_kind infrared_kind = {.size = sizeof(infrared), .noise = 31, .pins = 2, .init = init};
