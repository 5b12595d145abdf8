/* battery.c: see battery.h. */
#include "battery.h"

#include <string.h>

static void step(part *base) {
  battery *self = (battery *)base;
  chassis *c = base->chassis;
  double motors_a = c->bridges_a;
  for (int side = 0; side < 2; side++) {
    const chassis_wheel *wheel = &c->wheel[side];
    if (wheel->is_bridged) continue;
    motors_a += supply_servo_current(&self->parameters.supply, wheel->powered, wheel->speed, wheel->torque);
  }
  c->motors_a = motors_a;
  supply_step(&self->parameters.supply, &self->supply, motors_a, c->at_charger,
              (double)c->step_cycles / BOARD_CLOCK_HZ);
  fault *sagging = part_fault(base, FAULT_SAGGING, c->since);
  if (sagging != NULL && sagging->value < self->supply.pack_v) {
    supply_sag(&self->parameters.supply, &self->supply, sagging->value);
    sagging->fired++;
  }
  c->pack_v = self->supply.pack_v;
}

static double analog(part *base, uint64_t cycle) {
  battery *self = (battery *)base;
  const double noise = self->parameters.noise_v * noise_next_normal(&base->noise);
  const double v = self->supply.pack_v * self->parameters.divider + noise;
  return v < 0.0 ? 0.0 : (v > SUPPLY_NOMINAL_V ? SUPPLY_NOMINAL_V : v);
}

static const part_operations OPERATIONS = {.step = step, .analog = analog};

void battery_init(battery *self, const part_place *place, uint8_t channel, const battery_parameters *parameters) {
  memset(self, 0, sizeof *self);
  const uint8_t pin = channel == PART_NO_PIN ? PART_NO_PIN : (uint8_t)(BOARD_FIRST_ANALOG_PIN + channel);
  part_join(&self->part, &OPERATIONS, place, &(part_pin){pin, PART_ANALOG}, 1);
  self->parameters = *parameters;
  supply_init(&parameters->supply, &self->supply, parameters->charge);
  place->chassis->pack_v = self->supply.pack_v;
}
