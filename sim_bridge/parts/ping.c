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

void ping_init(ping *self, const part_place *place, uint8_t pin, const ping_parameters *parameters) {
  memset(self, 0, sizeof *self);
  self->place = *place;
  self->pin = pin;
  self->parameters = *parameters;
  self->answer = PING_ANSWER_WORLD;
  self->distance = -1.0;
}

/* Length of the echo pulse. */
static uint64_t echo(ping *self) {
  const ping_parameters *p = &self->parameters;
  const part_mount mount = {p->x, p->y, p->heading, p->beam};
  const double sound = 331.5 + 0.6 * p->temperature_c; /* m/s */
  const double spread = 1.0 + p->sigma * noise_next_normal(&self->place.noise);
  const int missed = noise_next_uniform(&self->place.noise) < p->miss;
  self->distance = missed ? -1.0 : part_look(&self->place, &mount, p->rays, p->range_maximum_m, p->grazing_cosine);
  if (self->distance < 0.0) return ECHO_MAXIMUM;
  double d = self->distance * spread;
  if (d < p->range_minimum_m) d = p->range_minimum_m;
  const uint64_t cycles = (uint64_t)(2.0 * d / sound * BOARD_CLOCK_HZ + 0.5);
  return cycles < ECHO_MINIMUM ? ECHO_MINIMUM : (cycles > ECHO_MAXIMUM ? ECHO_MAXIMUM : cycles);
}

int ping_edge(ping *self, uint64_t cycle, uint8_t level) {
  const uint8_t high = level == BOARD_HIGH;
  if (high == self->high) return 0;
  self->high = high;
  if (high) {
    self->rise = cycle;
    return 0;
  }
  const uint64_t width = cycle - self->rise;
  if (width < TRIGGER_CYCLES || width > TRIGGER_MAXIMUM || self->rise < self->ready) return 0;
  const uint64_t start = cycle + HOLD_OFF_CYCLES;
  const uint64_t end = start + (self->answer >= 0 ? (uint64_t)self->answer : echo(self));
  if (self->answer == PING_ANSWER_NONE) return 1;
  part_drive(&self->place, start, self->pin, BOARD_HIGH);
  part_drive(&self->place, end, self->pin, BOARD_LOW);
  part_drive(&self->place, end + REST_CYCLES / 2, self->pin, BOARD_RELEASED);
  self->ready = end + REST_CYCLES;
  self->ping_cycle = cycle;
  self->pings++;
  return 1;
}
