/* light.c: see light.h. */
#include "light.h"

#include <math.h>

#include "geometry/numbers.h"

static double supply_volts(const light_sensor *self) { return self->part.chassis->supply * BOARD_NOMINAL_VOLTS; }

/* On the capacitor at `cycle`. */
static double volts_at(const light_sensor *self, uint64_t cycle) {
  const double seconds = (double)(cycle - self->since) / BOARD_CLOCK_HZ;
  if (!self->charging) {
    const double left = self->volts - self->decay_per_s * seconds;
    return left > 0.0 ? left : 0.0;
  }
  const double full = supply_volts(self);
  if (!(self->parameters.charge_s > 0.0)) return full;
  return full - (full - self->volts) * number_exp(-seconds / self->parameters.charge_s); /* of an RC element */
}

static void begin(light_sensor *self, uint64_t cycle, int charging) {
  self->volts = volts_at(self, cycle);
  self->charging = (uint8_t)charging;
  self->since = cycle;
}

/* The board has let go: a constant current, so the voltage falls in a straight line. */
static void decay(light_sensor *self, uint64_t cycle, uint8_t pin) {
  const light_sensor_parameters *p = &self->parameters;
  const viewpoint from = part_view(&self->part, cycle);
  begin(self, cycle, 0);
  self->irradiance = phototransistor_read(&self->phototransistor, &from, &self->part.noise);
  const double seconds = phototransistor_decay_time(self->irradiance, p->decay_s, p->maximum_s);
  self->decay_per_s = (BOARD_NOMINAL_VOLTS - p->threshold_v) / seconds;
  const double above = self->volts - p->threshold_v;
  part_drive(&self->part, cycle, pin, above > 0.0 ? BOARD_HIGH : BOARD_LOW);
  if (above <= 0.0) return;
  const double cycles = above / self->decay_per_s * BOARD_CLOCK_HZ;
  part_drive(&self->part, cycle + 1 + (uint64_t)cycles, pin, BOARD_LOW);
}

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  light_sensor *self = (light_sensor *)base;
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

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  light_sensor *self = (light_sensor *)base;
  const light_sensor_parameters *p = parameters;
  if (phototransistor_init(&self->phototransistor, &p->light) != 0) return -1;
  if (!(p->decay_s > 0.0 && p->maximum_s >= p->decay_s && isfinite(p->maximum_s) && p->charge_s >= 0.0)) return -1;
  if (!(p->threshold_v > 0.0 && p->threshold_v < BOARD_NOMINAL_VOLTS)) return -1;
  part_join(base, &OPERATIONS, place, &(part_pin){pins[0], PART_HEARS | PART_DRIVES}, 1);
  self->parameters = *p;
  return 0;
}

static const part_kind KIND = {.size = sizeof(light_sensor), .noise = 71, .pins = 1, .init = init};
const part_kind *const light_kind = &KIND;
