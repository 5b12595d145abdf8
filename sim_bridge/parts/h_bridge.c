/* h_bridge.c: see h_bridge.h. */
#include "h_bridge.h"

#define PULSES_S 0.01 /* several pulses of PWM */

enum { ENABLE = 2, INPUTS };

typedef struct {
  part part;
  h_bridge_part_parameters parameters;
  int side;                /* 0 left, 1 right */
  uint8_t is_high[INPUTS]; /* by the place among its pins */
  h_bridge_flow flow;      /* since the world's step began */
  uint64_t until;          /* up to there */
  double speed;            /* of the shaft when it began, rad/s */
  double carried;          /* by the gear to the wheel, N m, mean of some pulses */
  double through;          /* A s through the motor since power-on */
  double through_then;     /* when it was last asked */
  uint64_t asked;          /* and that cycle */
} h_bridge;

static int drives(const h_bridge *self) { return self->is_high[ENABLE] && self->is_high[0] != self->is_high[1]; }

static int switches(const h_bridge *self) {
  if (!self->is_high[ENABLE] || self->part.unplugged) return H_BRIDGE_COAST;
  if (part_fault(&self->part, FAULT_DEAD, self->until) != NULL) return H_BRIDGE_COAST;
  if (!drives(self)) return H_BRIDGE_BRAKE;
  const int reversed = part_fault(&self->part, FAULT_REVERSED, self->until) != NULL;
  return self->is_high[self->parameters.forward] != reversed ? H_BRIDGE_FORWARD : H_BRIDGE_BACKWARD;
}

/* Counts faults of what drives from that cycle on. */
static void count_faults(h_bridge *self, uint64_t cycle) {
  if (!drives(self)) return;
  part_fires(&self->part, FAULT_DEAD, cycle);
  part_fires(&self->part, FAULT_REVERSED, cycle);
}

/* The current flows on up to that cycle. */
static void pass(h_bridge *self, uint64_t cycle) {
  if (cycle <= self->until) return;
  const h_bridge_part_parameters *p = &self->parameters;
  const double before = self->flow.charge;
  h_bridge_run(&p->bridge, &p->motor, &self->flow, switches(self), self->part.chassis->pack_v, self->speed,
               (double)(cycle - self->until) / BOARD_CLOCK_HZ);
  self->through += self->flow.charge - before;
  self->until = cycle;
}

static void edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  h_bridge *self = (h_bridge *)base;
  pass(self, cycle);
  for (int i = 0; i < INPUTS; i++) {
    if (base->pins[i].pin == pin) self->is_high[i] = level == BOARD_HIGH || level == BOARD_PULLED_UP;
  }
  count_faults(self, cycle);
}

/* The wheel's torque in a step of `dt` for that mean current. What a gear loses goes against the motion: it lessens what
 * the motor gives to the wheel, and adds to what the wheel must give where it drives the motor. The teeth change sides by
 * the mean of some pulses: the rotor's inertia carries it through each. */
static double torque_of(h_bridge *self, double current, double dt) {
  motor_dc_parameters motor = self->parameters.motor;
  const double hold = body_wheel_hold(self->part.chassis->body, dt);
  const double torque = motor_dc_shaft_torque(&motor, current, self->speed, hold);
  self->carried += dt / (dt + PULSES_S) * (torque - self->carried);
  if (self->carried * self->speed >= 0.0) return torque;
  motor.efficiency = 1.0 / motor.efficiency;
  return motor_dc_shaft_torque(&motor, current, self->speed, hold);
}

/* The torque of the coming step, by what flowed since the last one. */
static void before_step(part *base) {
  h_bridge *self = (h_bridge *)base;
  const h_bridge_part_parameters *p = &self->parameters;
  chassis *c = base->chassis;
  const double dt = (double)c->step_cycles / BOARD_CLOCK_HZ;
  pass(self, c->since);
  count_faults(self, c->since);
  chassis_wheel *wheel = &c->wheel[self->side];
  self->speed = wheel->speed / p->wheel_radius;
  wheel->torque = torque_of(self, self->flow.charge / dt, dt);
  wheel->is_bridged = 1;
  part_weaken(base, wheel);
  c->bridges_a += p->idle_a + self->flow.drawn / dt;
  self->flow.charge = self->flow.drawn = 0.0;
}

/* Of a copy: who looks at it changes no bit of the run. */
static int read(part *base, double *values) {
  h_bridge *self = (h_bridge *)base;
  h_bridge now = *self;
  pass(&now, base->chassis->board->op->now(base->chassis->board));
  const double seconds = (double)(now.until - self->asked) / BOARD_CLOCK_HZ;
  *values = seconds > 0.0 ? (now.through - self->through_then) / seconds : now.flow.current;
  self->through_then = now.through;
  self->asked = now.until;
  return 1;
}

static const part_operations OPERATIONS = {.edge = edge, .before_step = before_step, .read = read};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  h_bridge *self = (h_bridge *)base;
  const part_pin joined[INPUTS] = {{pins[0], PART_HEARS}, {pins[1], PART_HEARS}, {pins[ENABLE], PART_HEARS}};
  part_join(base, &OPERATIONS, place, joined, INPUTS);
  self->parameters = *(const h_bridge_part_parameters *)parameters;
  self->side = place->index;
  self->is_high[ENABLE] = pins[ENABLE] == PART_NO_PIN;
  self->until = self->asked = place->chassis->board->op->now(place->chassis->board);
  return self->parameters.motor.resistance_ohm > 0.0 ? 0 : -1;
}

const part_kind h_bridge_kind = {.size = sizeof(h_bridge), .noise = 150, .pins = INPUTS, .init = init};
