/* servo.c: see servo.h. */
#include "servo.h"

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  servo *self = (servo *)base;
  if (!part_pulse_ends(&self->pulse, cycle, level)) return;
  double width = (double)(cycle - self->pulse.rise) * (1e6 / BOARD_CLOCK_HZ);
  if (part_fires(base, FAULT_DEAD, cycle) != NULL) return;
  if (part_fires(base, FAULT_REVERSED, cycle) != NULL) width = 2.0 * self->parameters.centre_us - width;
  const fault *offset = part_fires(base, FAULT_OFFSET, cycle);
  if (offset != NULL) width += offset->value;
  if (servo_motor_pulse(&self->parameters, &self->motor, width)) self->pulses++;
}

/* The torque of the coming step, by the wheel's speed and the supply as it begins. */
static void before_step(part *base) {
  servo *self = (servo *)base;
  chassis_wheel *wheel = &base->chassis->wheel[self->side];
  wheel->powered = self->pulses > 0;
  wheel->torque = servo_motor_torque(&self->parameters, &self->motor, wheel->speed, base->chassis->servo_supply);
  part_weaken(base, wheel);
}

static const part_operations OPERATIONS = {.edge = edge, .before_step = before_step};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  servo *self = (servo *)base;
  part_join(base, &OPERATIONS, place, &(part_pin){pins[0], PART_HEARS}, 1);
  self->side = place->index;
  self->parameters = *(const servo_motor_parameters *)parameters;
  servo_motor_init(&self->parameters, &self->motor, (double)place->chassis->step_cycles / BOARD_CLOCK_HZ);
  return 0;
}

const part_kind servo_kind = {.size = sizeof(servo), .noise = 1, .pins = 1, .init = init};
