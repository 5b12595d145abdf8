/* turret.c: see turret.h. */
#include "turret.h"

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  turret *self = (turret *)base;
  if (!part_pulse_ends(&self->pulse, cycle, level)) return;
  const double width = (double)(cycle - self->pulse.rise) * (1e6 / BOARD_CLOCK_HZ);
  motor_position_pulse(&self->parameters, &self->motor, width);
}

static void step(part *base) {
  turret *self = (turret *)base;
  self->carried.before = self->motor.angle;
  motor_position_step(&self->parameters, &self->motor, base->chassis->servo_supply,
                      (double)base->chassis->step_cycles / BOARD_CLOCK_HZ);
  self->carried.angle = self->motor.angle;
}

static int read(part *base, double *values) {
  *values = ((turret *)base)->motor.angle;
  return 1;
}

static const part_operations OPERATIONS = {.edge = edge, .step = step, .read = read};

turret *turret_of(part *base) { return base->op == &OPERATIONS ? (turret *)base : NULL; }

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  turret *self = (turret *)base;
  const turret_parameters *p = parameters;
  part_join(base, &OPERATIONS, place, &(part_pin){pins[0], PART_HEARS}, 1);
  self->parameters = p->motor;
  motor_position_init(&self->motor, 0.0);
  self->carried = (part_turret){.x = p->x, .y = p->y};
  return 0;
}

const part_kind turret_kind = {.size = sizeof(turret), .noise = 76, .pins = 1, .init = init};
