/* supply.c: see supply.h. */
#include "supply.h"

#include <math.h>

static double within_one(double value) { return value < 0.0 ? 0.0 : (value > 1.0 ? 1.0 : value); }

double supply_servo_current(const supply_parameters *p, int pulsed, double speed, double torque) {
  double current = p->servo_a_per_n_m * fabs(torque);
  if (pulsed) current += p->servo_idle_a + p->servo_run_a_s_m * fabs(speed);
  return current;
}

void supply_sag(const supply_parameters *p, supply *self, double pack_v) {
  self->pack_v = pack_v;
  self->board_v = self->pack_v - p->drop_out_v;
  if (self->board_v > SUPPLY_NOMINAL_V) self->board_v = SUPPLY_NOMINAL_V;
  if (self->board_v < 0.0) self->board_v = 0.0;
  self->servo_v = p->unregulated != 0.0 ? self->pack_v : self->board_v;
}

static void load(const supply_parameters *p, supply *self, double current) {
  const double pack_v = p->empty_v + (p->full_v - p->empty_v) * self->charge - p->resistance_ohm * current;
  supply_sag(p, self, pack_v < 0.0 ? 0.0 : pack_v);
}

void supply_init(const supply_parameters *p, supply *self, double charge) {
  self->charge = within_one(charge);
  load(p, self, p->board_a);
}

void supply_step(const supply_parameters *p, supply *self, double motors_a, int at_charger, double dt) {
  const double current = p->board_a + motors_a - (at_charger ? p->charger_a : 0.0);
  if (p->capacity_as > 0.0) self->charge = within_one(self->charge - current * dt / p->capacity_as);
  load(p, self, current);
}

double energy_step(const energy_parameters *p, double energy, double left, double right, int at_charger, double dt) {
  const double rate =
      (at_charger ? p->charger_per_s : 0.0) - p->idle_per_s - p->signal_per_s * (fabs(left) + fabs(right));
  return within_one(energy + rate * dt);
}
