/* ping.c: see ping.h. */
#include "ping.h"

#define CYCLES_PER_US (BOARD_CLOCK_HZ / 1000000u)

static uint64_t cycles_of(double seconds) { return (uint64_t)(seconds * BOARD_CLOCK_HZ + 0.5); }

/* Length of the echo pulse of a ping. */
static uint64_t echo(ping *self, const viewpoint *from) {
  self->distance = sonar_ping(&self->sonar, from, &self->part.noise);
  if (self->distance < 0.0) return self->nothing;
  const uint64_t cycles = cycles_of(sonar_echo_time(&self->sonar, self->distance));
  return cycles < self->shortest ? self->shortest : (cycles > self->nothing ? self->nothing : cycles);
}

/* An echo pulse that begins at `start`. Returns when it ends. */
static uint64_t pulse(ping *self, uint64_t start, uint64_t length) {
  part_drive(&self->part, start, self->echo_pin, BOARD_HIGH);
  part_drive(&self->part, start + length, self->echo_pin, BOARD_LOW);
  return start + length;
}

/* A trigger ended at `cycle`. */
static void answer(ping *self, uint64_t cycle) {
  const viewpoint from = part_view(&self->part, cycle);
  const uint64_t length = echo(self, &from);
  if (part_fires(&self->part, FAULT_MISSING, cycle) != NULL) return;
  const fault *late = part_fires(&self->part, FAULT_LATE, cycle);
  const fault *doubled = part_fires(&self->part, FAULT_DOUBLED, cycle);
  uint64_t end = pulse(self, cycle + self->delay + (late == NULL ? 0u : cycles_of(late->value)), length);
  if (doubled != NULL) end = pulse(self, end + cycles_of(doubled->value), length);
  if (self->idle_level != BOARD_LOW) part_drive(&self->part, end + self->rest / 2, self->echo_pin, self->idle_level);
  self->ready = end + self->rest;
  self->ping_cycle = cycle;
  self->pings++;
}

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  ping *self = (ping *)base;
  if (!part_pulse_ends(&self->pulse, cycle, level)) return;
  const uint64_t width = cycle - self->pulse.rise;
  if (width < self->trigger_minimum || width > self->trigger_maximum || self->pulse.rise < self->ready) return;
  answer(self, cycle);
}

static int read(part *base, double *values) {
  const ping *self = (const ping *)base;
  const uint64_t now = base->chassis->board->op->now(base->chassis->board);
  values[0] = self->distance;
  values[1] = self->pings == 0 ? -1.0 : (double)(now - self->ping_cycle) / BOARD_CLOCK_HZ;
  return 2;
}

static const part_operations OPERATIONS = {.edge = edge, .read = read};

static int init(ping *self, const part_place *place, const part_pin *pins, int count, const sonar_parameters *p) {
  if (sonar_init(&self->sonar, p) != 0) return -1;
  part_join(&self->part, &OPERATIONS, place, pins, count);
  self->echo_pin = pins[count - 1].pin;
  self->distance = -1.0;
  return 0;
}

static int init_ping(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  ping *self = (ping *)base;
  self->idle_level = BOARD_RELEASED;
  self->trigger_minimum = 2u * CYCLES_PER_US;
  self->trigger_maximum = 1000u * CYCLES_PER_US;
  self->delay = 750u * CYCLES_PER_US;
  self->shortest = PING_SHORTEST_US * CYCLES_PER_US;
  self->nothing = PING_NOTHING_US * CYCLES_PER_US;
  self->rest = 200u * CYCLES_PER_US;
  return init(self, place, &(part_pin){pins[0], PART_HEARS | PART_DRIVES}, 1, parameters);
}

static int init_ultrasonic(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  ping *self = (ping *)base;
  const ultrasonic_parameters *p = parameters;
  if (!(p->delay_s > 0.0 && p->delay_s <= 1.0 && p->nothing_s > 0.0 && p->nothing_s <= 1.0)) return -1;
  self->idle_level = BOARD_LOW;
  self->trigger_minimum = 10u * CYCLES_PER_US;
  self->trigger_maximum = UINT64_MAX;
  self->delay = cycles_of(p->delay_s);
  self->nothing = cycles_of(p->nothing_s);
  const part_pin both[] = {{pins[0], PART_HEARS}, {pins[1], PART_DRIVES}};
  if (pins[1] == PART_NO_PIN || init(self, place, both, 2, &p->sonar) != 0) return -1;
  part_drive(base, 0, pins[1], BOARD_LOW);
  return 0;
}

const part_kind ping_kind = {.size = sizeof(ping), .noise = 41, .pins = 1, .init = init_ping};
const part_kind ultrasonic_kind = {.size = sizeof(ping), .noise = 101, .pins = 2, .init = init_ultrasonic};
