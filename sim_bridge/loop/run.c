/* run.c: see loop.h. Here: the loop itself. */
#include <math.h>

#include "parts/infrared.h"
#include "state.h"

#define CONTACT_GAP (BOARD_CLOCK_HZ / 10u) /* touches nearer in time are one contact */
#define SLICE_CYCLES 4000u                 /* how often lines are looked at while somebody listens */

/* ---- what boards do and ask ---------------------------------------------------------------------------------------- */

void robot_on_edge(void *context, uint64_t cycle, uint8_t pin, uint8_t level) {
  robot *self = context;
  if (pin >= BOARD_PIN_COUNT) return;
  edge_log_add(&self->edges, cycle, pin, level);
  for (part **p = self->hears[pin]; *p != NULL; p++) {
    if (!(*p)->unplugged) (*p)->op->edge(*p, cycle, pin, robot_heard(self, *p, pin, level));
  }
}

uint8_t robot_heard(const robot *self, const part *by, uint8_t pin, uint8_t level) {
  const uint8_t outside = self->outside[pin];
  if (level < BOARD_RELEASED || outside == BOARD_RELEASED || (part_role(by, pin) & PART_DRIVES)) return level;
  return outside;
}

void robot_on_outside(void *context, uint64_t cycle, uint8_t pin, uint8_t level) {
  robot *self = context;
  const uint8_t drives = self->drives[pin];
  if (level == BOARD_HIGH && (drives & (PART_PULLED_UP | PART_WEAK_HIGH))) level = BOARD_PULLED_UP;
  if (level == BOARD_LOW && (drives & PART_WEAK_LOW)) level = BOARD_RELEASED;
  self->outside[pin] = level;
  const uint8_t output = self->board->op->output(self->board, pin);
  for (part **p = self->hears[pin]; output >= BOARD_RELEASED && *p != NULL; p++) {
    if ((*p)->unplugged || (part_role(*p, pin) & PART_DRIVES)) continue;
    (*p)->op->edge(*p, cycle, pin, robot_heard(self, *p, pin, output));
  }
}

double robot_on_analog(void *context, uint64_t cycle, uint8_t channel) {
  robot *self = context;
  if (channel == BOARD_ANALOG_SUPPLY) return self->chassis.supply * BOARD_NOMINAL_VOLTS;
  if (channel >= BOARD_ANALOG_COUNT) return 0.0;
  if (!isnan(self->held[channel])) return self->sampled[channel] = self->held[channel];
  part *p = self->analog[channel];
  const uint8_t pin = (uint8_t)(BOARD_FIRST_ANALOG_PIN + channel), driven = self->chassis.driven[pin];
  if (driven <= BOARD_HIGH && (p == NULL || !self->drives[pin])) { /* by a digital part, or by a test */
    const uint8_t *levels = self->board->op->extension(self->board, BOARD_PIN_LEVELS);
    return self->sampled[channel] =
               (levels == NULL ? driven : levels[pin]) ? self->chassis.supply * BOARD_NOMINAL_VOLTS : 0.0;
  }
  return self->sampled[channel] = p == NULL || p->unplugged ? 0.0 : p->op->analog(p, cycle);
}

/* ---- the world's step ---------------------------------------------------------------------------------------------- */

/* What the LEDs of all robots sent in the last step reaches the receivers of the others one step later. */
static void exchange_light(sim *self) {
  for (int i = 0; i < self->robot_count; i++) {
    const robot *from = self->robots[i];
    for (int k = 0; k < from->part_count; k++) {
      infrared *sender = infrared_of(from->parts[k]);
      infrared_burst burst;
      infrared_light span;
      if (sender == NULL || !infrared_take_burst(sender, &burst, &span)) continue;
      span.from += self->step_cycles + PART_GUARD;
      span.until += self->step_cycles + PART_GUARD;
      for (int j = 0; j < self->robot_count; j++) {
        const robot *to = self->robots[j];
        for (int n = 0; j != i && n < to->part_count; n++) {
          infrared *receiver = infrared_of(to->parts[n]);
          if (receiver != NULL) infrared_see_burst(receiver, &burst, &span);
        }
      }
    }
  }
}

/* Faults of the wheels and of the whole robot, for the step that begins under these torques. */
static void take_faults(robot *r, const double torques[2]) {
  chassis *c = &r->chassis;
  body_faults *now = &r->body->faults;
  fault *lifted = fault_find(c->faults[2], FAULT_LIFTED, c->since);
  *now = (body_faults){.lifted = lifted != NULL, .grip = {INFINITY, INFINITY}};
  for (int side = 0; side < 2; side++) {
    const int turns = torques[side] != 0.0 || c->wheel[side].speed != 0.0;
    fault *blocked = fault_find(c->faults[side], FAULT_BLOCKED, c->since);
    fault *slipping = fault_find(c->faults[side], FAULT_SLIPPING, c->since);
    if (lifted != NULL) lifted->fired += (uint64_t)turns;
    if (blocked != NULL) blocked->fired += (uint64_t)turns;
    now->blocked[side] = blocked != NULL;
    now->any |= lifted != NULL || blocked != NULL || slipping != NULL;
    if (slipping == NULL) continue;
    slipping->fired += (uint64_t)r->body->state.slipping;
    now->grip[side] = slipping->value;
  }
}

/* Motors say their torque for the step that begins. */
static void begin_step(void *owner, double torques[2]) {
  robot *r = owner;
  chassis *c = &r->chassis;
  const body_state *s = &r->body->state;
  c->since = r->sim->world_at;
  c->x = s->x;
  c->y = s->y;
  c->heading = s->heading;
  c->at_charger = arena_is_at_charger(r->sim->world.arena, s->x, s->y);
  c->bridges_a = 0.0;
  c->wheel[SIM_LEFT] = (chassis_wheel){.speed = s->rim_left};
  c->wheel[SIM_RIGHT] = (chassis_wheel){.speed = s->rim_right};
  for (int i = 0; i < r->part_count; i++) {
    part *p = r->parts[i];
    if (p->op->before_step != NULL) p->op->before_step(p);
  }
  for (int side = 0; side < 2; side++) torques[side] = c->wheel[side].torque;
  if (r->vehicle != NULL) VEHICLE_OPERATIONS.torques(r->vehicle->worlds, torques);
  if (r->fault_count > 0) take_faults(r, torques);
}

static void has_moved(void *owner) {
  const robot *r = owner;
  if (r->vehicle != NULL) VEHICLE_OPERATIONS.moved(r->vehicle->worlds);
}

/* Parts follow the body to the end of the step. */
static void end_step(void *owner) {
  robot *r = owner;
  const uint64_t end = r->sim->world_at + r->sim->step_cycles;
  for (int i = 0; i < r->part_count; i++) {
    part *p = r->parts[i];
    if (p->op->step != NULL) p->op->step(p);
  }
  if (r->vehicle != NULL) {
    VEHICLE_OPERATIONS.sense(r->vehicle->worlds);
  } else {
    robot_update_supply(r);
    brown_out_step(&r->brown_out, r->board, r->chassis.supply * BOARD_NOMINAL_VOLTS, r->sim->world.dt);
  }
  if (!r->body->state.touching) return;
  if (r->contacts == 0 || end - r->last_touch > CONTACT_GAP) r->contacts++;
  r->last_touch = end;
  r->touched = 1;
}

const world_robot_operations ROBOT_OPERATIONS = {.torques = begin_step, .moved = has_moved, .sense = end_step};

static void step_world(sim *self) {
  if (self->record_cycles > 0 && self->world_at >= self->next_record) {
    for (int i = 0; i < self->robot_count; i++) robot_record(self->robots[i], self->world_at);
    self->next_record += self->record_cycles;
  }
  if (self->robot_count > 1) exchange_light(self);
  world_step(&self->world);
  if (self->record_cycles > 0) sim_record_waits(self, self->world_at);
  self->world_at += self->step_cycles;
}

/* ---- running ------------------------------------------------------------------------------------------------------- */

static void take_bytes(robot *r) {
  enum { CHUNK = 64 };
  uint64_t cycles[CHUNK];
  for (;;) {
    uint8_t *room = buffer_room(&r->received, CHUNK);
    if (room == NULL) return;
    const size_t count = r->board->op->receive(r->board, room, cycles, CHUNK);
    if (count > 0) r->last_byte = cycles[count - 1];
    if (r->is_stamped) buffer_append(&r->received_at, cycles, count * sizeof *cycles);
    r->received.count += count;
    if (count < CHUNK) return;
  }
}

/* Lines are looked at only at the ends of world steps and slices, counted from power-on: when a robot is heard does not
 * depend on how the others cut the run. */
static int is_look(const sim *self) { return self->now == self->world_at || self->now % SLICE_CYCLES == 0; }

/* Bytes have come since somebody listens to the robot, and its line has been idle since. */
static int message_waits(const robot *r, uint64_t now) {
  return now >= r->listen_from && r->received.count > 0 && now >= r->last_byte + r->idle;
}

static int somebody_speaks(const sim *self) {
  for (int i = 0; i < self->robot_count; i++) {
    if (message_waits(self->robots[i], self->now)) return 1;
  }
  return 0;
}

/* The first slice's end after `now` at which that robot may be heard. */
static uint64_t next_slice(const sim *self, const robot *r) {
  const uint64_t from = r->listen_from > self->now ? r->listen_from : self->now + 1u;
  return from > SIM_NEVER - SLICE_CYCLES ? SIM_NEVER : (from + SLICE_CYCLES - 1u) / SLICE_CYCLES * SLICE_CYCLES;
}

/* Up to where boards run next. */
static uint64_t next_target(const sim *self, uint64_t deadline) {
  uint64_t target = self->world_at < deadline ? self->world_at : deadline;
  for (int i = 0; i < self->robot_count; i++) {
    const uint64_t slice = next_slice(self, self->robots[i]);
    if (slice < target) target = slice;
  }
  return target;
}

/* Up to where all boards have run, `target` at most. */
static uint64_t all_have_run(const sim *self, uint64_t target) {
  for (int i = 0; i < self->robot_count; i++) {
    const board *b = self->robots[i]->board;
    if (b != NULL && b->op->now(b) < target) target = b->op->now(b);
  }
  return target;
}

static int run(sim *self, uint64_t deadline) {
  while (self->now < deadline) {
    if (self->world_at <= self->now) step_world(self);
    const uint64_t target = next_target(self, deadline);
    for (int i = 0; i < self->robot_count; i++) {
      robot *r = self->robots[i];
      if (r->board == NULL) continue;
      const board_state state = r->board->op->advance(r->board, target);
      if (state == BOARD_CRASHED || state == BOARD_STOPPED) return 1 + r->number;
      take_bytes(r);
      if (state != BOARD_PAUSED) continue;
      self->now = all_have_run(self, target);
      return SIM_PAUSED;
    }
    self->now = target;
    if (is_look(self) && somebody_speaks(self)) return 0;
  }
  return 0;
}

int sim_run_until(sim *self, uint64_t deadline) {
  if (self->runs) return SIM_RUNS;
  self->runs = true;
  const int ended = run(self, deadline);
  self->runs = false;
  return ended;
}

int robot_wait(robot *self, uint64_t cycles, uint64_t quiet) {
  self->listen_from = self->sim->now + quiet;
  return sim_run_until(self->sim, self->sim->now + cycles);
}

int robot_speaks(const robot *self) { return is_look(self->sim) && message_waits(self, self->sim->now); }

/* ---- the lines ----------------------------------------------------------------------------------------------------- */

void robot_send(robot *self, const uint8_t *bytes, size_t count) {
  if (count > 0) self->board->op->send(self->board, self->sim->now + PART_GUARD, bytes, count);
}

void robot_line_rate(robot *self, uint32_t baud) {
  if (baud > 0) self->idle = line_idle_cycles(baud);
  self->board->op->line_rate(self->board, baud);
}
