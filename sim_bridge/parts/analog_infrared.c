/* analog_infrared.c: see analog_infrared.h. */
#include "analog_infrared.h"

static double volts(analog_infrared *self, uint64_t cycle) {
  const viewpoint from = part_view(&self->part, cycle);
  return sharp_infrared_read(&self->sensor, &self->state, &from, (double)cycle / BOARD_CLOCK_HZ, &self->part.noise);
}

/* It measures by its own clock, asked or not: at a measurement within this step, from where the body is then. */
static void step(part *base) {
  analog_infrared *self = (analog_infrared *)base;
  if (!(self->sensor.period > 0.0)) return; /* it measures when it is asked */
  const double next = self->state.next * BOARD_CLOCK_HZ;
  if (next < (double)part_step_end(base)) volts(self, next > 0.0 ? (uint64_t)(next + 0.999) : 0u);
}

static double analog(part *base, uint64_t cycle) {
  const double v = volts((analog_infrared *)base, cycle);
  return v > BOARD_NOMINAL_VOLTS ? BOARD_NOMINAL_VOLTS : v;
}

static const part_operations OPERATIONS = {.step = step, .analog = analog};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  analog_infrared *self = (analog_infrared *)base;
  if (pins[0] < BOARD_FIRST_ANALOG_PIN || sharp_infrared_init(&self->sensor, parameters) != 0) return -1;
  part_join(base, &OPERATIONS, place, &(part_pin){pins[0], PART_ANALOG}, 1);
  return 0;
}

const part_kind analog_infrared_kind = {.size = sizeof(analog_infrared), .noise = 66, .pins = 1, .init = init};
