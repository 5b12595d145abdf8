/* join.c: see loop.h. Here: a simulation, its robots and their parts come and go. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "state.h"

#define LINE_RATE 500000u /* bit/s, unless set */

/* ---- simulation ---------------------------------------------------------------------------------------------------- */

sim *sim_new(arena *where, uint64_t seed, uint32_t step_cycles, uint32_t record_cycles, int noise) {
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
    board_outside_log *log = r->board->op->extension(r->board, BOARD_OUTSIDE_LOG);
    if (log != NULL) log->heard = NULL;
    r->board->op->analog(r->board, NULL, NULL);
  }
  if (r->vehicle != NULL) vehicles_destroy(r->vehicle);
  for (int i = 0; i < r->part_count; i++) free(r->parts[i]);
  free(r->parts);
  for (int i = 0; i < r->fault_count; i++) free(r->faults[i]);
  free(r->faults);
  buffer_free(&r->received);
  buffer_free(&r->received_at);
  buffer_free(&r->truth);
  edge_log_free(&r->edges);
  free(r);
}

void sim_destroy(sim *self) {
  for (int i = 0; i < self->robot_count; i++) destroy_robot(self->robots[i]);
  free(self->robots);
  buffer_free(&self->waits);
  buffer_free(&self->shifts);
  free(self);
}

/* ---- robots -------------------------------------------------------------------------------------------------------- */

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

static part_place place_of(robot *r, uint32_t kind, int index) {
  return (part_place){
      .chassis = &r->chassis,
      .noise = {.seed = r->sim->seed,
                .robot = (uint32_t)r->number,
                .device = kind + (uint32_t)index,
                .on = r->sim->noise != 0},
      .index = index,
  };
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
      .pack_v = BOARD_NOMINAL_VOLTS,
  };
  memset(r->chassis.driven, BOARD_RELEASED, sizeof r->chassis.driven);
  insert(self, r);
  world_update(&self->world);
  sim_sense_anew(self);
}

int sim_add_robot(sim *self, int number, uintptr_t address, const body_parameters *parameters, double x, double y,
                  double heading) {
  board *b = (board *)address;
  if (b->op->version != BOARD_INTERFACE_VERSION) return SIM_WRONG_BOARD;
  if (!world_is_free(&self->world, x, y, body_reach_of(parameters), 0)) return SIM_NOT_FREE;
  robot *r = sim_new_robot(self, number, b);
  if (r == NULL) return SIM_NO_MEMORY;
  body_init(r->body, parameters, 0.0);
  r->brown_out.noise = place_of(r, BROWN_OUT_NOISE, 0).noise;
  r->brown_out.parameters = (brown_out_parameters){
      .reset_v = SUPPLY_RESET_V, .hysteresis_v = 0.05, .erratic_v = SUPPLY_ERRATIC_V, .upsets_per_s = 2.0};
  b->sink = robot_on_edge;
  b->sink_context = r;
  b->op->analog(b, robot_on_analog, r);
  for (unsigned i = 0; i < BOARD_ANALOG_COUNT; i++) r->sampled[i] = r->held[i] = NAN;
  memset(r->outside, BOARD_RELEASED, sizeof r->outside);
  sim_insert(self, r, x, y, heading);
  return SIM_OK;
}

/* ---- parts --------------------------------------------------------------------------------------------------------- */

static int is_pin(uint8_t pin) { return pin < BOARD_PIN_COUNT; }

/* Room for a part of that size in the robot's list, or NULL. */
static void *new_part(robot *r, size_t size) {
  part **parts = realloc(r->parts, (size_t)(r->part_count + 1) * sizeof *parts);
  if (parts == NULL) return NULL;
  r->parts = parts;
  return calloc(1, size);
}

/* The robot has the part from now on; it hears its pins, beginning with what the board does to them now. A part is
 * refused, and freed, where another one drives one of its pins or gives the voltage there, or as many as can hear it do. */
static int join(robot *r, part *p) {
  for (int i = 0; i < PART_PINS; i++) {
    const uint8_t pin = p->pins[i].pin;
    if (!is_pin(pin)) continue;
    const int full = (p->pins[i].role & PART_HEARS) && r->hears[pin][HEARING_PARTS - 1] != NULL;
    const int given = (p->pins[i].role & PART_ANALOG) && r->analog[pin - BOARD_FIRST_ANALOG_PIN] != NULL;
    if (!full && !given && !((p->pins[i].role & PART_DRIVES) && r->drives[pin])) continue;
    free(p);
    return SIM_PIN_TAKEN;
  }
  r->parts[r->part_count++] = p;
  board_checks *checks = r->board->op->extension(r->board, BOARD_CHECKS);
  board_outside_log *log = r->board->op->extension(r->board, BOARD_OUTSIDE_LOG);
  for (int i = 0; i < PART_PINS; i++) {
    const uint8_t pin = p->pins[i].pin, role = p->pins[i].role;
    if (!is_pin(pin)) continue;
    if (checks != NULL) {
      const uint32_t drives = (uint32_t)((role & PART_DRIVES) != 0) << pin;
      if ((role & (uint8_t)~PART_HEARS) && !(role & PART_OPENS)) checks->joined |= 1u << pin;
      if (role == PART_ANALOG) checks->analog |= 1u << pin;
      if (!(role & (PART_PULLED_UP | PART_WEAK_HIGH))) checks->pulls_high |= drives;
      if (!(role & PART_WEAK_LOW)) checks->pulls_low |= drives;
    }
    if (p->pins[i].role & PART_ANALOG) r->analog[pin - BOARD_FIRST_ANALOG_PIN] = p;
    if (role & PART_DRIVES) r->drives[pin] = role;
    if (role & PART_HEARS) {
      part **last = r->hears[pin];
      while (*last != NULL) last++;
      *last = p;
      const uint8_t level = r->board->op->output(r->board, pin);
      if (level != BOARD_LOW) p->op->edge(p, r->board->op->now(r->board), pin, level);
    }
    part *const *hears = r->hears[pin];
    if (log == NULL || !r->drives[pin] || hears[0] == NULL) continue;
    if (hears[1] == NULL && (part_role(hears[0], pin) & PART_DRIVES)) continue; /* only itself */
    log->heard = robot_on_outside;
    log->heard_context = r;
  }
  return SIM_OK;
}

int robot_add_part(robot *self, const part_kind *kind, int index, const uint8_t *pins, const void *parameters) {
  for (int i = 0; i < kind->pins; i++) {
    if (!is_pin(pins[i]) && (i == 0 || pins[i] != PART_NO_PIN)) return SIM_BAD_ARGUMENT;
  }
  part *p = new_part(self, kind->size);
  if (p == NULL) return SIM_NO_MEMORY;
  const part_place place = place_of(self, kind->noise, index);
  if (kind->init(p, &place, pins, parameters) == 0) return join(self, p);
  free(p);
  return SIM_BAD_ARGUMENT;
}

int robot_add_battery(robot *self, uint8_t channel, const battery_parameters *parameters) {
  const part_place place = place_of(self, BATTERY_NOISE, 0);
  if (self->battery != NULL) { /* a fresh one */
    battery_init(self->battery, &place, channel, parameters);
    return SIM_OK;
  }
  battery *b = new_part(self, sizeof *b);
  if (b == NULL) return SIM_NO_MEMORY;
  battery_init(b, &place, channel, parameters);
  const int status = join(self, &b->part);
  if (status == SIM_OK) self->battery = b;
  return status;
}

int robot_mount(robot *self, uint8_t turret_pin, uint8_t pin) {
  turret *t = robot_turret(self, turret_pin);
  int status = SIM_BAD_ARGUMENT;
  for (int i = 0; t != NULL && i < self->part_count; i++) {
    part *p = self->parts[i];
    for (int k = 0; k < PART_PINS; k++) {
      if (p->pins[k].pin != pin || !(p->pins[k].role & (PART_DRIVES | PART_ANALOG))) continue;
      p->turret = &t->carried;
      status = SIM_OK;
    }
  }
  return status;
}
