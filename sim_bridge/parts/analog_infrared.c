/* analog_infrared.c: see analog_infrared.h. */
#include "analog_infrared.h"

#include <string.h>

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

int analog_infrared_init(analog_infrared *self, const part_place *place, uint8_t channel,
                         const sharp_infrared_parameters *parameters) {
  memset(self, 0, sizeof *self);
  if (sharp_infrared_init(&self->sensor, parameters) != 0) return -1;
  const uint8_t pin = (uint8_t)(BOARD_FIRST_ANALOG_PIN + channel);
  part_join(&self->part, &OPERATIONS, place, &(part_pin){pin, PART_ANALOG}, 1);
  return 0;
}
