/* capacitor.c: see capacitor.h. */
#include "capacitor.h"

#include "geometry/numbers.h"

/* On the capacitor at `cycle`. */
static double volts_at(const capacitor *self, uint64_t cycle) {
  const double seconds = (double)(cycle - self->since) / BOARD_CLOCK_HZ;
  if (!self->charging) {
    const double left = self->volts - self->decay_per_s * seconds;
    return left > 0.0 ? left : 0.0;
  }
  const double full = self->part.chassis->supply * BOARD_NOMINAL_VOLTS;
  if (!(self->parameters.charge_s > 0.0)) return full;
  return full - (full - self->volts) * number_exp(-seconds / self->parameters.charge_s); /* of an RC element */
}

static void begin(capacitor *self, uint64_t cycle, int charging) {
  self->volts = volts_at(self, cycle);
  self->charging = (uint8_t)charging;
  self->since = cycle;
}

/* The board has let go: a constant current, so the voltage falls in a straight line. */
static void decay(capacitor *self, uint64_t cycle, uint8_t pin) {
  begin(self, cycle, 0);
  const double decay_s = self->decay_time(self, cycle) / part_light_left(&self->part, cycle);
  self->decay_per_s = (BOARD_NOMINAL_VOLTS - self->parameters.threshold_v) / decay_s;
  const double above = self->volts - self->parameters.threshold_v;
  part_drive(&self->part, cycle, pin, above > 0.0 ? BOARD_HIGH : BOARD_LOW);
  if (above <= 0.0) return;
  const double cycles = above / self->decay_per_s * BOARD_CLOCK_HZ;
  part_drive(&self->part, cycle + 1 + (uint64_t)cycles, pin, BOARD_LOW);
}

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  capacitor *self = (capacitor *)base;
  switch (level) {
    case BOARD_HIGH:
      begin(self, cycle, 1);
      part_drive(base, cycle, pin, BOARD_HIGH); /* takes back the end of a decay under way */
      break;
    case BOARD_LOW: /* a short: empty at once */
      begin(self, cycle, 0);
      self->volts = 0.0;
      self->decay_per_s = 0.0;
      part_drive(base, cycle, pin, BOARD_LOW);
      break;
    default: /* a pull-up is too weak to matter against full charge, and is not modelled */
      decay(self, cycle, pin);
      break;
  }
}

static const part_operations OPERATIONS = {.edge = edge};

void capacitor_init(capacitor *self, const part_place *place, uint8_t pin, const capacitor_parameters *parameters,
                    capacitor_decay decay_time) {
  part_join(&self->part, &OPERATIONS, place,
            &(part_pin){pin, PART_HEARS | PART_DRIVES | PART_WEAK_HIGH | PART_WEAK_LOW}, 1);
  self->parameters = *parameters;
  self->decay_time = decay_time;
}
