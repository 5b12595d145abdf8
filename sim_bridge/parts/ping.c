/* ping.c: see ping.h. */
#include "ping.h"

#include <string.h>

#define CYCLES_PER_US (BOARD_CLOCK_HZ / 1000000u)
#define TRIGGER_CYCLES (2u * CYCLES_PER_US)
#define TRIGGER_MAXIMUM (1000u * CYCLES_PER_US)
#define HOLD_OFF_CYCLES (750u * CYCLES_PER_US)
#define ECHO_MINIMUM (115u * CYCLES_PER_US)
#define ECHO_MAXIMUM (18500u * CYCLES_PER_US)
#define REST_CYCLES (200u * CYCLES_PER_US)

/* Length of the echo pulse of a ping at `cycle`. */
static uint64_t echo(ping *self, const part_pose *from) {
  const ping_parameters *p = &self->parameters;
  const double sound = 331.5 + 0.6 * p->temperature_c; /* m/s */
  const double spread = 1.0 + p->sigma * noise_next_normal(&self->part.noise);
  const int missed = noise_next_uniform(&self->part.noise) < p->miss;
  self->distance =
      missed ? -1.0
             : part_look(&self->part, from, p->beam, p->rays, PING_HEIGHT_M, p->range_maximum_m, p->grazing_cosine);
  if (self->distance < 0.0) return ECHO_MAXIMUM;
  double d = self->distance * spread;
  if (d < p->range_minimum_m) d = p->range_minimum_m;
  const uint64_t cycles = (uint64_t)(2.0 * d / sound * BOARD_CLOCK_HZ + 0.5);
  return cycles < ECHO_MINIMUM ? ECHO_MINIMUM : (cycles > ECHO_MAXIMUM ? ECHO_MAXIMUM : cycles);
}

/* The pin was let go at `cycle` after a trigger. */
static void answer(ping *self, uint64_t cycle, uint8_t pin) {
  const ping_parameters *p = &self->parameters;
  const part_mount mount = {p->x, p->y, p->heading, p->beam};
  const part_pose from = part_pose_at(&self->part, &mount, cycle);
  const uint64_t start = cycle + HOLD_OFF_CYCLES;
  const uint64_t end = start + (self->answer >= 0 ? (uint64_t)self->answer : echo(self, &from));
  part_log_look(&self->part, cycle, LOOK_PING, &from, p->beam, p->range_maximum_m, self->distance);
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
  const uint8_t high = level == BOARD_HIGH;
  if (high == self->high) return;
  self->high = high;
  if (high) {
    self->rise = cycle;
    return;
  }
  const uint64_t width = cycle - self->rise;
  if (width < TRIGGER_CYCLES || width > TRIGGER_MAXIMUM || self->rise < self->ready) return;
  answer(self, cycle, pin);
}

static const part_operations OPERATIONS = {.edge = edge};

ping *ping_of(part *base) { return base->op == &OPERATIONS ? (ping *)base : NULL; }

void ping_init(ping *self, const part_place *place, uint8_t pin, const ping_parameters *parameters) {
  memset(self, 0, sizeof *self);
  part_join(&self->part, &OPERATIONS, place, &(part_pin){pin, PART_HEARS | PART_DRIVES}, 1);
  self->parameters = *parameters;
  self->answer = PING_ANSWER_WORLD;
  self->distance = -1.0;
}
