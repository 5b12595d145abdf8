/* ping.c: see ping.h. */
#include "ping.h"

#define CYCLES_PER_US (BOARD_CLOCK_HZ / 1000000u)
#define TRIGGER_CYCLES (2u * CYCLES_PER_US)
#define TRIGGER_MAXIMUM (1000u * CYCLES_PER_US)
#define HOLD_OFF_CYCLES (750u * CYCLES_PER_US)
#define ECHO_MINIMUM (115u * CYCLES_PER_US)
#define ECHO_MAXIMUM (18500u * CYCLES_PER_US)
#define REST_CYCLES (200u * CYCLES_PER_US)

/* Length of the echo pulse of a ping. */
static uint64_t echo(ping *self, const viewpoint *from) {
  self->distance = sonar_ping(&self->sonar, from, &self->part.noise);
  if (self->distance < 0.0) return ECHO_MAXIMUM;
  const uint64_t cycles = (uint64_t)(sonar_echo_time(&self->sonar, self->distance) * BOARD_CLOCK_HZ + 0.5);
  return cycles < ECHO_MINIMUM ? ECHO_MINIMUM : (cycles > ECHO_MAXIMUM ? ECHO_MAXIMUM : cycles);
}

/* The pin was let go at `cycle` after a trigger. */
static void answer(ping *self, uint64_t cycle, uint8_t pin) {
  const viewpoint from = part_view(&self->part, cycle);
  const uint64_t start = cycle + HOLD_OFF_CYCLES;
  const uint64_t end = start + (self->answer >= 0 ? (uint64_t)self->answer : echo(self, &from));
  part_log_look(&self->part, cycle, LOOK_PING, &from, &self->mount, self->sonar.range_maximum, self->distance);
  if (self->answer == PING_ANSWER_NONE) return;
  part_drive(&self->part, start, pin, BOARD_HIGH);
  part_drive(&self->part, end, pin, BOARD_LOW);
  part_drive(&self->part, end + REST_CYCLES / 2, pin, BOARD_RELEASED);
  self->ready = end + REST_CYCLES;
  self->ping_cycle = cycle;
  self->pings++;
}

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  ping *self = (ping *)base;
  if (!part_pulse_ends(&self->pulse, cycle, level)) return;
  const uint64_t width = cycle - self->pulse.rise;
  if (width < TRIGGER_CYCLES || width > TRIGGER_MAXIMUM || self->pulse.rise < self->ready) return;
  answer(self, cycle, pin);
}

static const part_operations OPERATIONS = {.edge = edge};

ping *ping_of(part *base) { return base->op == &OPERATIONS ? (ping *)base : NULL; }

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  ping *self = (ping *)base;
  const sonar_parameters *p = parameters;
  if (sonar_init(&self->sonar, p) != 0) return -1;
  part_join(base, &OPERATIONS, place, &(part_pin){pins[0], PART_HEARS | PART_DRIVES}, 1);
  self->mount = p->beam;
  self->answer = PING_ANSWER_WORLD;
  self->distance = -1.0;
  return 0;
}

const part_kind ping_kind = {.size = sizeof(ping), .noise = 41, .pins = 1, .init = init};
