/* line_module.c: see line_module.h. */
#include "line_module.h"

#define SATURATED 0.06 /* parts of the supply */

typedef struct {
  part part;
  line_module_parameters parameters;
  reflectance sensor;
  double share; /* of the supply, at the end of the last step */
  int is_dark;
} line_module;

/* Parts of the supply at the node. */
static double share_at(line_module *self, uint64_t cycle) {
  const viewpoint from = part_view(&self->part, cycle);
  const double light = reflectance_read(&self->sensor, &from, &self->part.noise);
  const double share = 1.0 - self->parameters.slope * (light * part_light_left(&self->part, cycle));
  return share < SATURATED ? SATURATED : share;
}

static double volts(const line_module *self, double share) {
  return share * self->part.chassis->supply * BOARD_NOMINAL_VOLTS;
}

/* Looks at the floor as it is at `cycle`; the comparator follows at `at`. */
static void look(part *base, uint64_t cycle, uint64_t at) {
  line_module *self = (line_module *)base;
  const line_module_parameters *p = &self->parameters;
  self->share = share_at(self, cycle);
  self->is_dark = self->share > p->threshold + (self->is_dark ? -p->hysteresis : p->hysteresis);
  const uint8_t level = (uint8_t)(self->is_dark == (p->dark_level == BOARD_HIGH) ? BOARD_HIGH : BOARD_LOW);
  if (p->is_digital && level != base->level[0]) {
    part_drive(base, at, base->pins[0].pin, level);
  }
}

static void step(part *base) { look(base, part_step_end(base), part_step_end(base) + PART_GUARD); }

static double analog(part *base, uint64_t cycle) {
  line_module *self = (line_module *)base;
  return volts(self, share_at(self, cycle));
}

static int read(part *base, double *values) {
  const line_module *self = (line_module *)base;
  values[0] = volts(self, self->share);
  values[1] = self->is_dark;
  return 2;
}

static const part_operations OPERATIONS = {.step = step, .analog = analog, .read = read};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  line_module *self = (line_module *)base;
  self->parameters = *(const line_module_parameters *)parameters;
  if (reflectance_init(&self->sensor, &self->parameters.floor) != 0) return -1;
  const uint8_t role = self->parameters.is_digital ? PART_DRIVES : PART_ANALOG;
  part_join(base, &OPERATIONS, place, &(part_pin){pins[0], role}, 1);
  look(base, place->chassis->since, 0); /* setup() may read it at once */
  return 0;
}

const part_kind line_module_kind = {.size = sizeof(line_module), .noise = 160, .pins = 1, .init = init};
