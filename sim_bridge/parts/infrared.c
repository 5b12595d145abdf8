/* infrared.c: see infrared.h. */
#include "infrared.h"

#include <math.h>
#include <string.h>

#define PERIOD_MINIMUM 360u /* 44.4 kHz */
#define PERIOD_MAXIMUM 480u /* 33.3 kHz */
#define CYCLES_TO_HEAR 8u
#define HOLD_CYCLES (10u * 421u) /* the output stays low for ten periods after the last one */

double infrared_range_share(uint32_t period_cycles) {
  /* Sensitivity against frequency, relative to its peak; light falls with the square of the distance. */
  static const double kilohertz[] = {33.0, 35.0, 36.5, 38.0, 38.5, 39.0, 40.0, 41.0, 42.0, 45.0};
  static const double sensitivity[] = {0.02, 0.15, 0.55, 0.97, 1.00, 0.90, 0.50, 0.33, 0.20, 0.02};
  const double f = 16000.0 / (double)period_cycles;
  double s = 0.02;
  for (size_t i = 0; i + 1 < sizeof kilohertz / sizeof kilohertz[0]; i++) {
    if (f < kilohertz[i] || f > kilohertz[i + 1]) continue;
    s = sensitivity[i] + (sensitivity[i + 1] - sensitivity[i]) * (f - kilohertz[i]) / (kilohertz[i + 1] - kilohertz[i]);
    break;
  }
  return sqrt(s / 0.97);
}

static void look(infrared *self, uint64_t cycle, uint32_t period) {
  const infrared_parameters *p = &self->parameters;
  const part_mount mount = {p->x, p->y, p->heading, p->beam};
  const part_pose from = part_pose_at(&self->part, &mount, cycle);
  const double spread = 1.0 + p->range_sigma * noise_next_normal(&self->part.noise); /* (3.1) */
  const int falsely = noise_next_uniform(&self->part.noise) < p->false_hit;
  self->reach = p->range_m * infrared_range_share(period) * (spread > 0.0 ? spread : 0.0);
  self->distance = part_look(&self->part, &from, p->beam, p->rays, INFRARED_HEIGHT_M, self->reach, 0.0);
  self->seen = (uint8_t)(falsely || self->distance >= 0.0);
  self->burst_cycle = cycle;
  self->bursts++;
  part_log_look(&self->part, cycle, LOOK_INFRARED, &from, p->beam, self->reach, self->distance);
}

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  infrared *self = (infrared *)base;
  (void)pin;
  if (level != BOARD_HIGH) return;
  const uint64_t period = cycle - self->last_rise;
  self->last_rise = cycle;
  if (period < PERIOD_MINIMUM || period > PERIOD_MAXIMUM) {
    self->carrier_cycles = 0;
    self->seen = 0;
    return;
  }
  self->carrier_cycles++;
  if (self->carrier_cycles == CYCLES_TO_HEAR) look(self, cycle, (uint32_t)period);
  if (self->seen) { /* low from now on takes back the end that was queued a period ago */
    part_drive(base, cycle, self->receiver_pin, BOARD_LOW);
    part_drive(base, cycle + HOLD_CYCLES, self->receiver_pin, BOARD_HIGH);
  }
}

static const part_operations OPERATIONS = {.edge = edge};

void infrared_init(infrared *self, const part_place *place, uint8_t led_pin, uint8_t receiver_pin,
                   const infrared_parameters *parameters) {
  memset(self, 0, sizeof *self);
  const part_pin pins[] = {{led_pin, PART_HEARS}, {receiver_pin, PART_DRIVES | PART_PULLED_UP}};
  part_join(&self->part, &OPERATIONS, place, pins, 2);
  self->receiver_pin = receiver_pin;
  self->parameters = *parameters;
  part_drive(&self->part, 0, receiver_pin, BOARD_HIGH);
}
