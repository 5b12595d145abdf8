/* join.c: see loop.h. Here: a simulation, its robots and their parts come and go. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "parts/buzzer.h"
#include "state.h"

#define BITS_PER_BYTE 10u
#define LINE_RATE 500000u /* bit/s, unless set */

uint64_t line_idle_cycles(uint32_t baud) { return 2u * BITS_PER_BYTE * (uint64_t)BOARD_CLOCK_HZ / baud; }

/* ---- simulation ---------------------------------------------------------------------------------------------------- */

sim *sim_new(arena *where, uint64_t seed, uint32_t step_cycles, uint32_t record_cycles, int noise) {
  if (where == NULL || step_cycles < 2 * PART_GUARD || record_cycles % step_cycles != 0) return NULL;
  if (arena_moving_count(where) > SIM_OBSTACLES_MAXIMUM) return NULL;
  sim *self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
  self->seed = seed;
  self->step_cycles = step_cycles;
  self->record_cycles = record_cycles;
  self->noise = noise;
  world_init(&self->world, where, (double)step_cycles / BOARD_CLOCK_HZ, self->movers);
  self->world.robots = self->members;
  return self;
}

static void destroy_robot(robot *r) {
  if (r->board != NULL) {
    r->board->sink = NULL;
    r->board->op->analog(r->board, NULL, NULL);
  }
  vehicles_destroy(r->vehicle);
  for (int i = 0; i < r->part_count; i++) free(r->parts[i]);
  free(r->parts);
  buffer_free(&r->received);
  buffer_free(&r->truth);
  buffer_free(&r->looks);
  buffer_free(&r->tones);
  edge_log_free(&r->edges);
  free(r);
}

void sim_destroy(sim *self) {
  if (self == NULL) return;
  for (int i = 0; i < self->robot_count; i++) destroy_robot(self->robots[i]);
  free(self->robots);
  buffer_free(&self->inputs);
  buffer_free(&self->waits);
  free(self);
}

/* ---- robots -------------------------------------------------------------------------------------------------------- */

robot *sim_robot(const sim *self, int number) {
  for (int i = 0; i < self->robot_count; i++) {
    if (self->robots[i]->number == number) return self->robots[i];
  }
  return NULL;
}

robot *sim_robot_with_board(const sim *self, int number) {
  robot *r = sim_robot(self, number);
  return r == NULL || r->board == NULL ? NULL : r;
}

/* Its place in the order of numbers. */
static void insert(sim *self, robot *r) {
  int i = self->robot_count++;
  for (; i > 0 && self->robots[i - 1]->number > r->number; i--) self->robots[i] = self->robots[i - 1];
  self->robots[i] = r;
  for (i = 0; i < self->robot_count; i++) {
    self->members[i] = (world_robot){.body = self->robots[i]->body, .op = &ROBOT_OPERATIONS, .owner = self->robots[i]};
  }
  self->world.count = (size_t)self->robot_count;
}

static part_place place_of(robot *r, uint32_t device) {
  return (part_place){
      .chassis = &r->chassis,
      .noise = {.seed = r->sim->seed, .robot = (uint32_t)r->number, .device = device, .on = r->sim->noise != 0},
  };
}

int sim_has_room(const sim *self, int number, double reach, double x, double y, double heading) {
  if (number < 0 || sim_robot(self, number) != NULL || self->robot_count == BODY_MAXIMUM) return SIM_BAD_ARGUMENT;
  if (self->now > 0 || !(fabs(heading) <= BODY_HEADING_LIMIT) || !isfinite(x + y)) return SIM_BAD_ARGUMENT;
  return world_is_free(&self->world, x, y, reach, 0) ? SIM_OK : SIM_NOT_FREE;
}

robot *sim_new_robot(sim *self, int number, board *b) {
  robot **robots = realloc(self->robots, (size_t)(self->robot_count + 1) * sizeof *robots);
  if (robots == NULL) return NULL;
  self->robots = robots;
  robot *r = calloc(1, sizeof *r);
  if (r == NULL) return NULL;
  r->sim = self;
  r->number = number;
  r->board = b;
  r->body = &r->own;
  r->idle = line_idle_cycles(LINE_RATE);
  r->listen_from = SIM_NEVER;
  return r;
}

void sim_insert(sim *self, robot *r, double x, double y, double heading) {
  r->body->id = robot_mover_id(r->number);
  body_place(r->body, x, y, heading);
  r->chassis = (chassis){
      .board = r->board,
      .body = r->body,
      .around = &self->world.around,
      .self_id = r->body->id,
      .since = self->world_at,
      .step_cycles = self->step_cycles,
      .x = x,
      .y = y,
      .heading = heading,
      .supply = 1.0,
      .servo_supply = 1.0,
      .recording = self->record_cycles > 0,
      .looks = &r->looks,
      .tones = &r->tones,
  };
  memset(r->chassis.driven, BOARD_RELEASED, sizeof r->chassis.driven);
  insert(self, r);
  world_update(&self->world);
  sim_sense_anew(self);
}

int sim_add_robot(sim *self, int number, uintptr_t address, const body_parameters *parameters, double x, double y,
                  double heading) {
  if (board_check(address) != SIM_OK) return SIM_WRONG_BOARD;
  const int room = sim_has_room(self, number, body_reach_of(parameters), x, y, heading);
  if (room != SIM_OK) return room;
  board *b = (board *)address;
  robot *r = sim_new_robot(self, number, b);
  if (r == NULL) return SIM_NO_MEMORY;
  body_init(r->body, parameters, 0.0);
  r->brown_out.noise = place_of(r, PART_BROWN_OUT).noise;
  r->brown_out.parameters = (brown_out_parameters){
      .reset_v = SUPPLY_RESET_V, .hysteresis_v = 0.05, .erratic_v = SUPPLY_ERRATIC_V, .upsets_per_s = 2.0};
  b->sink = robot_on_edge;
  b->sink_context = r;
  b->op->analog(b, robot_on_analog, r);
  sim_insert(self, r, x, y, heading);
  return SIM_OK;
}

/* ---- parts --------------------------------------------------------------------------------------------------------- */

static int is_pin(uint8_t pin) { return pin < BOARD_PIN_COUNT; }

static int is_side(int side) { return side == SIM_LEFT || side == SIM_RIGHT; }

/* The place of one more part of a kind of which a robot may have several. */
static part_place next_place(robot *r, uint32_t kind) { return place_of(r, kind + (uint32_t)r->parts_of_kind[kind]++); }

/* Room for a part of that size in the robot's list, or NULL. */
static void *new_part(robot *r, size_t size) {
  if (r == NULL) return NULL;
  part **parts = realloc(r->parts, (size_t)(r->part_count + 1) * sizeof *parts);
  if (parts == NULL) return NULL;
  r->parts = parts;
  return calloc(1, size);
}

/* The robot has the part from now on; it hears its pins, beginning with what the board does to them now. A part is
 * refused, and freed, where another one hears one of its pins already, or gives the voltage there. */
static int join(robot *r, part *p) {
  for (int i = 0; i < PART_PINS; i++) {
    const uint8_t pin = p->pins[i].pin;
    if (!is_pin(pin)) continue;
    const int heard = (p->pins[i].role & PART_HEARS) && r->hears[pin] != NULL;
    const int given = (p->pins[i].role & PART_ANALOG) && r->analog[pin - BOARD_FIRST_ANALOG_PIN] != NULL;
    if (!heard && !given) continue;
    free(p);
    return SIM_PIN_TAKEN;
  }
  r->parts[r->part_count++] = p;
  for (int i = 0; i < PART_PINS; i++) {
    const uint8_t pin = p->pins[i].pin;
    if (!is_pin(pin)) continue;
    if (p->pins[i].role & PART_ANALOG) r->analog[pin - BOARD_FIRST_ANALOG_PIN] = p;
    if (!(p->pins[i].role & PART_HEARS)) continue;
    r->hears[pin] = p;
    const uint8_t level = r->board->op->output(r->board, pin);
    if (level != BOARD_LOW) p->op->edge(p, r->board->op->now(r->board), pin, level);
  }
  return SIM_OK;
}

/* The same for a part whose `_init` may have found its parameters to be bad. */
static int join_if(robot *r, part *p, int status) {
  if (status == 0) return join(r, p);
  free(p);
  return SIM_BAD_ARGUMENT;
}

int sim_add_servo(sim *self, int number, int side, uint8_t pin, const servo_motor_parameters *parameters) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || !is_pin(pin) || !is_side(side)) return SIM_BAD_ARGUMENT;
  servo *s = new_part(r, sizeof *s);
  if (s == NULL) return SIM_NO_MEMORY;
  const part_place place = place_of(r, PART_SERVO_LEFT + (uint32_t)side);
  servo_init(s, &place, pin, side, parameters, self->world.dt);
  return join(r, &s->part);
}

int sim_add_encoder(sim *self, int number, int side, uint8_t pin_a, uint8_t pin_b,
                    const encoder_parameters *parameters) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || !is_pin(pin_a) || !is_side(side) || parameters->edges_per_turn == 0) return SIM_BAD_ARGUMENT;
  encoder *e = new_part(r, sizeof *e);
  if (e == NULL) return SIM_NO_MEMORY;
  const part_place place = place_of(r, PART_ENCODER_LEFT + (uint32_t)side);
  encoder_init(e, &place, side, pin_a, pin_b, parameters);
  return join(r, &e->part);
}

/* What touches on the body reaches as far as this point of its frame. */
static void widen_reach(body *b, double x, double y) {
  const double distance = sqrt(x * x + y * y);
  if (distance > b->reach) b->reach = distance;
  b->near.slack = -1.0; /* look around again */
}

int sim_add_whisker(sim *self, int number, uint8_t pin, const whisker_parameters *parameters) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || !is_pin(pin)) return SIM_BAD_ARGUMENT;
  whisker *w = new_part(r, sizeof *w);
  if (w == NULL) return SIM_NO_MEMORY;
  const part_place place = next_place(r, PART_WHISKER);
  whisker_init(w, &place, pin, parameters);
  widen_reach(r->body, parameters->root_x, parameters->root_y);
  widen_reach(r->body, parameters->tip_x, parameters->tip_y);
  return join(r, &w->part);
}

int sim_add_infrared(sim *self, int number, uint8_t led_pin, uint8_t receiver_pin,
                     const infrared_pair_parameters *parameters) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || !is_pin(led_pin) || !is_pin(receiver_pin)) return SIM_BAD_ARGUMENT;
  infrared *i = new_part(r, sizeof *i);
  if (i == NULL) return SIM_NO_MEMORY;
  const part_place place = next_place(r, PART_INFRARED);
  return join_if(r, &i->part, infrared_init(i, &place, led_pin, receiver_pin, parameters));
}

int sim_add_ping(sim *self, int number, uint8_t pin, const sonar_parameters *parameters) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || !is_pin(pin)) return SIM_BAD_ARGUMENT;
  ping *p = new_part(r, sizeof *p);
  if (p == NULL) return SIM_NO_MEMORY;
  const part_place place = next_place(r, PART_PING);
  return join_if(r, &p->part, ping_init(p, &place, pin, parameters));
}

int sim_add_battery(sim *self, int number, uint8_t channel, const battery_parameters *parameters) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || (channel != PART_NO_PIN && channel >= BOARD_ANALOG_COUNT)) return SIM_BAD_ARGUMENT;
  if (r->battery != NULL) { /* a fresh one */
    const part_place place = place_of(r, PART_BATTERY);
    battery_init(r->battery, &place, channel, parameters);
    return SIM_OK;
  }
  battery *b = new_part(r, sizeof *b);
  if (b == NULL) return SIM_NO_MEMORY;
  const part_place place = place_of(r, PART_BATTERY);
  battery_init(b, &place, channel, parameters);
  const int status = join(r, &b->part);
  if (status == SIM_OK) r->battery = b;
  return status;
}

static two_wire *bus_at(const robot *r, uint8_t sda_pin, uint8_t scl_pin) {
  for (int i = 0; i < r->part_count; i++) {
    two_wire *bus = two_wire_of(r->parts[i]);
    if (bus != NULL && bus->sda_pin == sda_pin && bus->scl_pin == scl_pin) return bus;
  }
  return NULL;
}

/* The bus at those pins, a new one if need be; NULL without memory. */
static two_wire *bus_of(robot *r, uint8_t sda_pin, uint8_t scl_pin) {
  two_wire *bus = bus_at(r, sda_pin, scl_pin);
  if (bus != NULL) return bus;
  bus = new_part(r, sizeof *bus);
  if (bus == NULL) return NULL;
  const part_place place = next_place(r, PART_TWO_WIRE);
  two_wire_init(bus, &place, sda_pin, scl_pin);
  return join(r, &bus->part) == SIM_OK ? bus : NULL; /* the caller has checked that the pins are free */
}

int sim_add_compass(sim *self, int number, uint8_t sda_pin, uint8_t scl_pin, const hmc5883l_parameters *parameters) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || !is_pin(sda_pin) || !is_pin(scl_pin) || sda_pin == scl_pin) return SIM_BAD_ARGUMENT;
  if (bus_at(r, sda_pin, scl_pin) == NULL && (r->hears[sda_pin] != NULL || r->hears[scl_pin] != NULL)) {
    return SIM_PIN_TAKEN;
  }
  two_wire *bus = bus_of(r, sda_pin, scl_pin);
  compass *c = bus == NULL ? NULL : new_part(r, sizeof *c);
  if (c == NULL) return SIM_NO_MEMORY;
  const part_place place = next_place(r, PART_COMPASS);
  const int usable = compass_init(c, &place, parameters) == 0;
  if (usable && two_wire_attach(bus, &c->device) != 0) { /* two of them have one address */
    free(c);
    return SIM_PIN_TAKEN;
  }
  return join_if(r, &c->part, usable ? 0 : -1);
}

int sim_add_analog_infrared(sim *self, int number, uint8_t channel, const sharp_infrared_parameters *parameters) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || channel >= BOARD_ANALOG_COUNT) return SIM_BAD_ARGUMENT;
  analog_infrared *a = new_part(r, sizeof *a);
  if (a == NULL) return SIM_NO_MEMORY;
  const part_place place = next_place(r, PART_ANALOG_INFRARED);
  return join_if(r, &a->part, analog_infrared_init(a, &place, channel, parameters));
}

int sim_add_light_sensor(sim *self, int number, uint8_t pin, const light_sensor_parameters *parameters) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || !is_pin(pin)) return SIM_BAD_ARGUMENT;
  light_sensor *l = new_part(r, sizeof *l);
  if (l == NULL) return SIM_NO_MEMORY;
  const part_place place = next_place(r, PART_LIGHT_SENSOR);
  return join_if(r, &l->part, light_sensor_init(l, &place, pin, parameters));
}

int sim_add_buzzer(sim *self, int number, uint8_t pin) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || !is_pin(pin)) return SIM_BAD_ARGUMENT;
  buzzer *b = new_part(r, sizeof *b);
  if (b == NULL) return SIM_NO_MEMORY;
  const part_place place = next_place(r, PART_BUZZER);
  buzzer_init(b, &place, pin);
  return join(r, &b->part);
}

int sim_add_turret(sim *self, int number, uint8_t pin, double x, double y,
                   const motor_position_parameters *parameters) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || !is_pin(pin) || !isfinite(x + y)) return SIM_BAD_ARGUMENT;
  turret *t = new_part(r, sizeof *t);
  if (t == NULL) return SIM_NO_MEMORY;
  const part_place place = next_place(r, PART_TURRET);
  turret_init(t, &place, pin, x, y, parameters);
  return join(r, &t->part);
}

turret *robot_turret(const robot *self, uint8_t pin) {
  for (int i = 0; i < self->part_count; i++) {
    turret *t = turret_of(self->parts[i]);
    if (t != NULL && t->part.pins[0].pin == pin) return t;
  }
  return NULL;
}

int sim_mount(sim *self, int number, uint8_t turret_pin, uint8_t pin) {
  robot *r = sim_robot_with_board(self, number);
  turret *t = r == NULL ? NULL : robot_turret(r, turret_pin);
  int mounted = 0;
  for (int i = 0; t != NULL && i < r->part_count; i++) {
    part *p = r->parts[i];
    for (int k = 0; k < PART_PINS; k++) {
      if (p->pins[k].pin != pin || !(p->pins[k].role & (PART_DRIVES | PART_ANALOG))) continue;
      p->turret = &t->carried;
      mounted = 1;
    }
  }
  return mounted ? SIM_OK : SIM_BAD_ARGUMENT;
}
