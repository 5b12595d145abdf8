/* battery.c: see battery.h. */
#include "battery.h"

#include <math.h>
#include <string.h>

/* What the servos draw: standing, turning, and pushing. */
static double servo_current(const battery *self) {
  const battery_parameters *p = &self->parameters;
  double current = 0.0;
  for (int side = 0; side < 2; side++) {
    const chassis_wheel *wheel = &self->part.chassis->wheel[side];
    if (wheel->powered) current += p->servo_idle_a + p->servo_run_a_s_m * fabs(wheel->speed);
    current += p->servo_a_per_n_m * fabs(wheel->torque);
  }
  return current;
}

static void discharge(battery *self, double current, double dt) {
  const battery_parameters *p = &self->parameters;
  self->drawn_as += current * dt;
  double left = 1.0 - self->drawn_as / p->capacity_as;
  if (left < 0.0) left = 0.0;
  self->pack_v = p->empty_v + (p->full_v - p->empty_v) * left - p->resistance_ohm * current;
  if (self->pack_v < 0.0) self->pack_v = 0.0;
  self->regulated_v = self->pack_v - p->drop_out_v;
  if (self->regulated_v > BATTERY_NOMINAL_V) self->regulated_v = BATTERY_NOMINAL_V;
  if (self->regulated_v < 0.0) self->regulated_v = 0.0;
}

static void step(part *base) {
  battery *self = (battery *)base;
  const double dt = (double)base->chassis->step_cycles / BOARD_CLOCK_HZ;
  discharge(self, self->parameters.board_a + servo_current(self), dt);
}

static double analog(part *base, uint64_t cycle) {
  battery *self = (battery *)base;
  (void)cycle;
  const double v = self->pack_v * self->parameters.divider + self->parameters.noise_v * noise_next_normal(&base->noise);
  return v < 0.0 ? 0.0 : (v > BATTERY_NOMINAL_V ? BATTERY_NOMINAL_V : v);
}

static const part_operations OPERATIONS = {.step = step, .analog = analog};

void battery_init(battery *self, const part_place *place, uint8_t channel, const battery_parameters *parameters) {
  memset(self, 0, sizeof *self);
  const uint8_t pin = channel == PART_NO_PIN ? PART_NO_PIN : (uint8_t)(BOARD_FIRST_ANALOG_PIN + channel);
  part_join(&self->part, &OPERATIONS, place, &(part_pin){pin, PART_ANALOG}, 1);
  self->parameters = *parameters;
  discharge(self, parameters->board_a, 0.0);
}
