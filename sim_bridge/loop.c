/* loop.c: see loop.h. */
#include "loop.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "parts/encoder.h"
#include "world/numbers.h"

#define WHISKERS_MAXIMUM 4
#define INFRARED_MAXIMUM 4
#define PINGS_MAXIMUM 2
#define WAVES_MAXIMUM 4
#define CONTACT_GAP (BOARD_CLOCK_HZ / 10u) /* touches nearer in time are one contact */
#define SLICE_CYCLES 4000u                 /* how often the line is looked at while bytes are coming */
#define BITS_PER_BYTE 10u
#define LINE_RATE 500000u /* bit/s, unless set */

enum { LISTENER_NONE, LISTENER_SERVO, LISTENER_INFRARED, LISTENER_PING };

/* A growing array of bytes; what is in it is `count` bytes from `start` on. */
typedef struct {
  uint8_t *data;
  size_t start, count, capacity;
} buffer;

typedef struct {
  uint8_t pin;
  uint8_t level;
  uint32_t half;
  uint64_t next;
  uint64_t end;
} wave;

typedef struct {
  sim *sim;
  board *board;
  body body;
  servo servo[2];
  encoder encoder[2];
  int has_servo[2];
  int has_encoder[2];
  whisker whisker[WHISKERS_MAXIMUM];
  int whiskers;
  infrared infrared[INFRARED_MAXIMUM];
  int infrareds;
  ping ping[PINGS_MAXIMUM];
  int pings;
  battery battery;
  int has_battery;
  wave wave[WAVES_MAXIMUM];
  int waves;
  struct {
    uint8_t kind, number;
  } listener[BOARD_PIN_COUNT];
  uint8_t driven[BOARD_PIN_COUNT];
  double supply;      /* share of the nominal voltage, of the rail that board and servos run on */
  double held_supply; /* that share if a test holds it, or 0 */
  buffer received;
  uint64_t last_byte; /* cycle of the end of the last byte received */
  uint64_t idle;      /* cycles without a byte after which the line is idle: two bytes' time */
  buffer truth;
  buffer looks;
  sim_edge *edges; /* a ring once it has SIM_EDGES_KEPT */
  size_t edge_capacity;
  uint64_t edge_count;
  int touched; /* since the last row of the truth */
  uint64_t last_touch;
  uint64_t contacts;
} robot;

struct sim {
  arena *arena;
  uint64_t seed;
  uint32_t step_cycles;
  uint32_t record_cycles;
  int noise;
  double dt;
  uint64_t now;   /* boards have run up to here */
  uint64_t world; /* world and parts have run up to here */
  uint64_t next_record;
  robot **robots;
  int robot_count;
  int out_of_memory;
};

/* ---- buffers ---------------------------------------------------------------------------------------------------- */

/* Room for `size` more bytes, or NULL. */
static void *buffer_room(buffer *self, size_t size) {
  if (self->start + self->count + size > self->capacity) {
    if (self->start > 0) memmove(self->data, self->data + self->start, self->count);
    self->start = 0;
    if (self->count + size > self->capacity) {
      const size_t capacity = 2 * self->capacity + size + 256;
      uint8_t *data = realloc(self->data, capacity);
      if (data == NULL) return NULL;
      self->data = data;
      self->capacity = capacity;
    }
  }
  return self->data + self->start + self->count;
}

static void buffer_append(sim *self, buffer *to, const void *bytes, size_t size) {
  void *room = buffer_room(to, size);
  if (room == NULL) {
    self->out_of_memory = 1;
    return;
  }
  memcpy(room, bytes, size);
  to->count += size;
}

/* ---- edges of the boards ------------------------------------------------------------------------------------------ */

static void log_edge(robot *self, uint64_t cycle, uint8_t pin, uint8_t level) {
  if (self->edge_count >= self->edge_capacity && self->edge_capacity < SIM_EDGES_KEPT) {
    const size_t capacity = self->edge_capacity == 0 ? 4096 : 2 * self->edge_capacity;
    sim_edge *edges = realloc(self->edges, capacity * sizeof *edges);
    if (edges == NULL) {
      self->sim->out_of_memory = 1;
      return;
    }
    self->edges = edges;
    self->edge_capacity = capacity;
  }
  sim_edge *edge = &self->edges[self->edge_count++ & (self->edge_capacity - 1)];
  edge->cycle = cycle;
  edge->pin = pin;
  edge->level = level;
}

static void log_look(robot *self, uint64_t cycle, int kind, double x, double y, double heading, double beam,
                     double reach, double distance) {
  const body_state *s = &self->body.state;
  const sim_look look = {
      .time = (double)cycle / BOARD_CLOCK_HZ,
      .kind = kind,
      .x = s->x + x * s->cosine - y * s->sine,
      .y = s->y + x * s->sine + y * s->cosine,
      .heading = s->heading + heading,
      .beam = beam,
      .reach = reach,
      .distance = distance,
  };
  buffer_append(self->sim, &self->looks, &look, sizeof look);
}

static void on_edge(void *context, uint64_t cycle, uint8_t pin, uint8_t level) {
  robot *self = context;
  if (pin >= BOARD_PIN_COUNT) return;
  log_edge(self, cycle, pin, level);
  const int number = self->listener[pin].number;
  switch (self->listener[pin].kind) {
    case LISTENER_SERVO:
      servo_edge(&self->servo[number], cycle, level);
      break;
    case LISTENER_INFRARED: {
      infrared *part = &self->infrared[number];
      if (infrared_edge(part, cycle, level) && self->sim->record_cycles > 0) {
        const infrared_parameters *p = &part->parameters;
        log_look(self, cycle, 0, p->x, p->y, p->heading, p->beam, part->reach, part->distance);
      }
      break;
    }
    case LISTENER_PING: {
      ping *part = &self->ping[number];
      if (ping_edge(part, cycle, level) && self->sim->record_cycles > 0) {
        const ping_parameters *p = &part->parameters;
        log_look(self, cycle, 1, p->x, p->y, p->heading, p->beam, p->range_maximum_m, part->distance);
      }
      break;
    }
    default:
      break;
  }
}

static double on_analog(void *context, uint64_t cycle, uint8_t channel) {
  robot *self = context;
  (void)cycle;
  if (channel == BOARD_ANALOG_SUPPLY) return self->supply * SUPPLY_NOMINAL_V;
  if (self->has_battery && self->battery.channel == channel) return battery_sample(&self->battery);
  return 0.0;
}

/* ---- building ------------------------------------------------------------------------------------------------------ */

sim *sim_new(arena *where, uint64_t seed, uint32_t step_cycles, uint32_t record_cycles, int noise) {
  if (where == NULL || step_cycles < 2 * PART_GUARD || record_cycles % step_cycles != 0) return NULL;
  sim *self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
  self->arena = where;
  self->seed = seed;
  self->step_cycles = step_cycles;
  self->record_cycles = record_cycles;
  self->noise = noise;
  self->dt = (double)step_cycles / BOARD_CLOCK_HZ;
  return self;
}

void sim_destroy(sim *self) {
  if (self == NULL) return;
  for (int i = 0; i < self->robot_count; i++) {
    robot *r = self->robots[i];
    r->board->sink = NULL;
    r->board->op->analog(r->board, NULL, NULL);
    free(r->received.data);
    free(r->truth.data);
    free(r->looks.data);
    free(r->edges);
    free(r);
  }
  free(self->robots);
  free(self);
}

static uint64_t idle_cycles(uint32_t baud) { return 2u * BITS_PER_BYTE * (uint64_t)BOARD_CLOCK_HZ / baud; }

int sim_add_robot(sim *self, uintptr_t address, const body_parameters *parameters, double x, double y, double heading) {
  board *b = (board *)address;
  if (board_check(address) != SIM_OK) return SIM_WRONG_BOARD;
  robot **robots = realloc(self->robots, (size_t)(self->robot_count + 1) * sizeof *robots);
  if (robots == NULL) return SIM_NO_MEMORY;
  self->robots = robots;
  robot *r = calloc(1, sizeof *r);
  if (r == NULL) return SIM_NO_MEMORY;
  r->sim = self;
  r->board = b;
  r->idle = idle_cycles(LINE_RATE);
  r->supply = 1.0;
  memset(r->driven, BOARD_RELEASED, sizeof r->driven);
  body_init(&r->body, parameters, 0.0);
  body_place(&r->body, x, y, heading);
  b->sink = on_edge;
  b->sink_context = r;
  b->op->analog(b, on_analog, r);
  robots[self->robot_count] = r;
  return self->robot_count++;
}

static robot *find(const sim *self, int number) {
  return number >= 0 && number < self->robot_count ? self->robots[number] : NULL;
}

static part_place place_of(robot *r, uint32_t device) {
  const sim *self = r->sim;
  int number = 0;
  while (self->robots[number] != r) number++;
  const part_place place = {
      .board = r->board,
      .body = &r->body,
      .arena = self->arena,
      .noise = {.seed = self->seed, .robot = (uint32_t)number, .device = device, .on = self->noise},
      .driven = r->driven,
  };
  return place;
}

/* From now on the part hears that pin, beginning with what the board does to it now. */
static void listen(robot *r, uint8_t pin, uint8_t kind, int number) {
  r->listener[pin].kind = kind;
  r->listener[pin].number = (uint8_t)number;
  const uint8_t level = r->board->op->output(r->board, pin);
  const uint64_t edges = r->edge_count;
  if (level != BOARD_LOW) on_edge(r, r->board->op->now(r->board), pin, level);
  r->edge_count = edges;
}

static int bad_pin(uint8_t pin) { return pin >= BOARD_PIN_COUNT; }

int sim_add_servo(sim *self, int number, int side, uint8_t pin, const servo_motor_parameters *parameters) {
  robot *r = find(self, number);
  if (r == NULL || bad_pin(pin) || side < 0 || side > 1) return SIM_BAD_ARGUMENT;
  const part_place place = place_of(r, PART_SERVO_LEFT + (uint32_t)side);
  servo_init(&r->servo[side], &place, pin, parameters, self->dt);
  r->has_servo[side] = 1;
  listen(r, pin, LISTENER_SERVO, side);
  return SIM_OK;
}

int sim_add_encoder(sim *self, int number, int side, uint8_t pin_a, uint8_t pin_b, uint32_t edges_per_turn) {
  robot *r = find(self, number);
  if (r == NULL || bad_pin(pin_a) || side < 0 || side > 1 || edges_per_turn == 0) return SIM_BAD_ARGUMENT;
  const part_place place = place_of(r, PART_ENCODER_LEFT + (uint32_t)side);
  const body_state *s = &r->body.state;
  encoder_init(&r->encoder[side], &place, pin_a, pin_b, edges_per_turn,
               side == SIM_LEFT ? s->wheel_left : s->wheel_right);
  r->has_encoder[side] = 1;
  return SIM_OK;
}

int sim_add_whisker(sim *self, int number, uint8_t pin, const whisker_parameters *parameters) {
  robot *r = find(self, number);
  if (r == NULL || bad_pin(pin) || r->whiskers == WHISKERS_MAXIMUM) return SIM_BAD_ARGUMENT;
  const part_place place = place_of(r, PART_WHISKER + (uint32_t)r->whiskers);
  whisker_init(&r->whisker[r->whiskers++], &place, pin, parameters);
  const double root = sqrt(parameters->root_x * parameters->root_x + parameters->root_y * parameters->root_y);
  const double tip = sqrt(parameters->tip_x * parameters->tip_x + parameters->tip_y * parameters->tip_y);
  if (root > r->body.reach) r->body.reach = root;
  if (tip > r->body.reach) r->body.reach = tip;
  r->body.near.slack = -1.0;
  return SIM_OK;
}

int sim_add_infrared(sim *self, int number, uint8_t led_pin, uint8_t receiver_pin,
                     const infrared_parameters *parameters) {
  robot *r = find(self, number);
  if (r == NULL || bad_pin(led_pin) || bad_pin(receiver_pin) || r->infrareds == INFRARED_MAXIMUM)
    return SIM_BAD_ARGUMENT;
  const part_place place = place_of(r, PART_INFRARED + (uint32_t)r->infrareds);
  infrared_init(&r->infrared[r->infrareds], &place, led_pin, receiver_pin, parameters);
  listen(r, led_pin, LISTENER_INFRARED, r->infrareds++);
  return SIM_OK;
}

int sim_add_ping(sim *self, int number, uint8_t pin, const ping_parameters *parameters) {
  robot *r = find(self, number);
  if (r == NULL || bad_pin(pin) || r->pings == PINGS_MAXIMUM) return SIM_BAD_ARGUMENT;
  const part_place place = place_of(r, PART_PING + (uint32_t)r->pings);
  ping_init(&r->ping[r->pings], &place, pin, parameters);
  listen(r, pin, LISTENER_PING, r->pings++);
  return SIM_OK;
}

int sim_add_battery(sim *self, int number, uint8_t channel, const battery_parameters *parameters) {
  robot *r = find(self, number);
  if (r == NULL) return SIM_BAD_ARGUMENT;
  const part_place place = place_of(r, PART_BATTERY);
  battery_init(&r->battery, &place, channel, parameters);
  r->has_battery = 1;
  return SIM_OK;
}

/* ---- running ------------------------------------------------------------------------------------------------------ */

static void record(robot *r, uint64_t cycle) {
  const body_state *s = &r->body.state;
  const sim_truth row = {
      .time = (double)cycle / BOARD_CLOCK_HZ,
      .x = s->x,
      .y = s->y,
      .heading = s->heading,
      .speed = s->speed,
      .turn_rate = s->turn_rate,
      .left = body_left_speed(&r->body),
      .right = body_right_speed(&r->body),
      .contact = r->touched,
  };
  r->touched = s->touching;
  buffer_append(r->sim, &r->truth, &row, sizeof row);
}

static void step_waves(robot *r, uint64_t until) {
  for (int i = 0; i < r->waves; i++) {
    wave *w = &r->wave[i];
    for (; w->next <= until && w->next <= w->end; w->next += w->half) {
      w->level = !w->level;
      r->board->op->drive(r->board, w->next, w->pin, w->level);
    }
  }
}

static double supply_of(const robot *r) {
  if (r->held_supply > 0.0) return r->held_supply;
  return r->has_battery ? r->battery.supply.board_v / SUPPLY_NOMINAL_V : 1.0;
}

/* Share of the nominal voltage that the servos get. */
static double servo_supply_of(const robot *r) {
  if (r->held_supply > 0.0 || !r->has_battery) return r->supply;
  return r->battery.supply.servo_v / SUPPLY_NOMINAL_V;
}

/* World and parts of one robot, from self->world to self->world + step_cycles. */
static void step_robot(sim *self, robot *r) {
  const uint64_t begin = self->world;
  const uint64_t end = begin + self->step_cycles;
  body *b = &r->body;
  double torque[2] = {0.0, 0.0};
  double current = 0.0;
  for (int side = 0; side < 2; side++) {
    if (!r->has_servo[side]) continue;
    servo *s = &r->servo[side];
    const double speed = side == SIM_LEFT ? b->state.rim_left : b->state.rim_right;
    torque[side] = servo_torque(s, speed, servo_supply_of(r));
    current += supply_servo_current(&r->battery.parameters.supply, s->pulses > 0, speed, torque[side]);
  }
  const scene around = {.arena = self->arena};
  body_advance(b, &around, torque[SIM_LEFT], torque[SIM_RIGHT], self->dt);
  if (r->has_battery) battery_step(&r->battery, current, 0, self->dt);
  r->supply = supply_of(r);
  if (r->has_encoder[SIM_LEFT]) encoder_step(&r->encoder[SIM_LEFT], b->state.wheel_left, begin, self->step_cycles);
  if (r->has_encoder[SIM_RIGHT]) encoder_step(&r->encoder[SIM_RIGHT], b->state.wheel_right, begin, self->step_cycles);
  for (int i = 0; i < r->whiskers; i++) whisker_step(&r->whisker[i], end);
  if (r->waves > 0) step_waves(r, end + PART_GUARD);
  if (b->state.touching) {
    if (r->contacts == 0 || end - r->last_touch > CONTACT_GAP) r->contacts++;
    r->last_touch = end;
    r->touched = 1;
  }
}

static void step_world(sim *self) {
  if (self->record_cycles > 0 && self->world >= self->next_record) {
    for (int i = 0; i < self->robot_count; i++) record(self->robots[i], self->world);
    self->next_record += self->record_cycles;
  }
  for (int i = 0; i < self->robot_count; i++) step_robot(self, self->robots[i]);
  self->world += self->step_cycles;
}

static void take_bytes(robot *r) {
  enum { CHUNK = 64 };
  uint64_t cycles[CHUNK];
  for (;;) {
    uint8_t *room = buffer_room(&r->received, CHUNK);
    if (room == NULL) {
      r->sim->out_of_memory = 1;
      return;
    }
    const size_t count = r->board->op->receive(r->board, room, cycles, CHUNK);
    if (count > 0) r->last_byte = cycles[count - 1];
    r->received.count += count;
    if (count < CHUNK) return;
  }
}

int sim_run(sim *self, uint64_t max_cycles, uint64_t quiet_cycles) {
  const uint64_t deadline = self->now + max_cycles;
  const uint64_t earliest = self->now + (quiet_cycles < max_cycles ? quiet_cycles : max_cycles);
  while (self->now < deadline) {
    if (self->world <= self->now) step_world(self);
    uint64_t target = self->world < deadline ? self->world : deadline;
    int coming = 0;
    for (int i = 0; i < self->robot_count; i++) coming |= self->robots[i]->received.count > 0;
    if (coming && self->now >= earliest && self->now + SLICE_CYCLES < target) target = self->now + SLICE_CYCLES;
    int ready = 0;
    for (int i = 0; i < self->robot_count; i++) {
      robot *r = self->robots[i];
      if (r->board->op->advance(r->board, target) != BOARD_RUNNING) return 1 + i;
      take_bytes(r);
      ready |= r->received.count > 0 && target >= r->last_byte + r->idle;
    }
    self->now = target;
    if (ready && self->now >= earliest) return 0;
  }
  return 0;
}

uint64_t sim_now(const sim *self) { return self->now; }

void sim_send(sim *self, int number, const uint8_t *bytes, size_t count) {
  robot *r = find(self, number);
  if (r != NULL && count > 0) r->board->op->send(r->board, self->now + PART_GUARD, bytes, count);
}

int sim_line_rate(sim *self, int number, uint32_t baud) {
  robot *r = find(self, number);
  if (r == NULL || baud == 0) return SIM_BAD_ARGUMENT;
  r->idle = idle_cycles(baud);
  r->board->op->line_rate(r->board, baud);
  return SIM_OK;
}

uint64_t sim_last_byte(const sim *self, int number) {
  const robot *r = find(self, number);
  return r == NULL ? 0 : r->last_byte;
}

size_t sim_waiting(const sim *self, int number) {
  const robot *r = find(self, number);
  return r == NULL ? 0 : r->received.count;
}

size_t sim_receive(sim *self, int number, uint8_t *bytes, size_t capacity) {
  robot *r = find(self, number);
  if (r == NULL) return 0;
  const size_t count = r->received.count < capacity ? r->received.count : capacity;
  if (count == 0) return 0;
  memcpy(bytes, r->received.data + r->received.start, count);
  r->received.count -= count;
  r->received.start = r->received.count == 0 ? 0 : r->received.start + count;
  return count;
}

/* ---- truth --------------------------------------------------------------------------------------------------------- */

void sim_body(const sim *self, int number, body_state *out) {
  const robot *r = find(self, number);
  if (r != NULL) *out = r->body.state;
}

const sim_truth *sim_record(const sim *self, int number, size_t *count) {
  const robot *r = find(self, number);
  *count = r == NULL ? 0 : r->truth.count / sizeof(sim_truth);
  return r == NULL ? NULL : (const sim_truth *)(const void *)r->truth.data;
}

const sim_look *sim_looks(const sim *self, int number, size_t *count) {
  const robot *r = find(self, number);
  *count = r == NULL ? 0 : r->looks.count / sizeof(sim_look);
  return r == NULL ? NULL : (const sim_look *)(const void *)r->looks.data;
}

uint64_t sim_contacts(const sim *self, int number) {
  const robot *r = find(self, number);
  return r == NULL ? 0 : r->contacts;
}

uint64_t sim_hash(const sim *self) {
  uint64_t hash = 0xcbf29ce484222325u; /* FNV-1a */
  for (int i = 0; i < self->robot_count; i++) {
    const body_state *s = &self->robots[i]->body.state;
    const double state[] = {
        s->x,         s->y,          s->heading,     s->speed,    s->turn_rate,        s->lateral,         s->rim_left,
        s->rim_right, s->wheel_left, s->wheel_right, s->distance, (double)s->touching, (double)s->slipping};
    uint8_t bytes[sizeof state];
    memcpy(bytes, state, sizeof state);
    for (size_t k = 0; k < sizeof bytes; k++) hash = (hash ^ bytes[k]) * 0x100000001b3u;
  }
  return hash;
}

size_t sim_edges(const sim *self, int number, sim_edge *out, size_t capacity) {
  const robot *r = find(self, number);
  if (r == NULL) return 0;
  const uint64_t kept = r->edge_count < r->edge_capacity ? r->edge_count : r->edge_capacity;
  const uint64_t count = kept < capacity ? kept : capacity;
  for (uint64_t i = 0; i < count; i++) out[i] = r->edges[(r->edge_count - count + i) & (r->edge_capacity - 1)];
  return (size_t)count;
}

uint64_t sim_edges_seen(const sim *self, int number) {
  const robot *r = find(self, number);
  return r == NULL ? 0 : r->edge_count;
}

double sim_pack_voltage(const sim *self, int number) {
  const robot *r = find(self, number);
  return r == NULL ? 0.0 : r->battery.supply.pack_v;
}

double sim_supply_voltage(const sim *self, int number) {
  const robot *r = find(self, number);
  return r == NULL ? 0.0 : r->supply * SUPPLY_NOMINAL_V;
}

/* ---- hands of a test ------------------------------------------------------------------------------------------------ */

int sim_place(sim *self, int number, double x, double y, double heading) {
  robot *r = find(self, number);
  if (r == NULL || !arena_is_free(self->arena, x, y, r->body.parameters.radius)) return SIM_BAD_ARGUMENT;
  body_place(&r->body, x, y, heading);
  return SIM_OK;
}

/* Takes a pin from its part. Returns 1 if a resistor on the board pulls it up when nobody drives it. */
static int take_pin(robot *r, uint8_t pin) {
  int pulled_up = 0;
  for (int side = 0; side < 2; side++) {
    encoder *e = &r->encoder[side];
    if (r->has_encoder[side] && (e->pin_a == pin || e->pin_b == pin)) e->place.off = 1;
  }
  for (int i = 0; i < r->whiskers; i++) {
    if (r->whisker[i].pin != pin) continue;
    r->whisker[i].place.off = 1;
    pulled_up = 1;
  }
  for (int i = 0; i < r->infrareds; i++) {
    if (r->infrared[i].receiver_pin != pin) continue;
    r->infrared[i].place.off = 1;
    pulled_up = 1;
  }
  for (int i = 0; i < r->pings; i++) {
    if (r->ping[i].pin == pin) r->ping[i].place.off = 1;
  }
  return pulled_up;
}

int sim_drive(sim *self, int number, uint64_t at, uint8_t pin, uint8_t level) {
  robot *r = find(self, number);
  if (r == NULL || bad_pin(pin) || level > BOARD_RELEASED) return SIM_BAD_ARGUMENT;
  const int pulled_up = take_pin(r, pin);
  for (int i = 0; i < r->waves; i++) {
    if (r->wave[i].pin == pin) r->wave[i].end = 0;
  }
  if (level == BOARD_RELEASED && pulled_up) level = BOARD_HIGH;
  r->driven[pin] = level;
  r->board->op->drive(r->board, at, pin, level);
  return SIM_OK;
}

int sim_wave(sim *self, int number, uint8_t pin, uint32_t half_cycles, uint64_t duration) {
  robot *r = find(self, number);
  if (r == NULL || bad_pin(pin) || half_cycles == 0) return SIM_BAD_ARGUMENT;
  take_pin(r, pin);
  int i = 0; /* the place of this pin's wave, or of one that is over, or a new one */
  while (i < r->waves && r->wave[i].pin != pin) i++;
  if (i == r->waves) i = 0;
  while (i < r->waves && r->wave[i].pin != pin && r->wave[i].next <= r->wave[i].end) i++;
  if (i == WAVES_MAXIMUM) return SIM_BAD_ARGUMENT;
  if (i == r->waves) r->waves++;
  const uint64_t start = self->world + PART_GUARD; /* edges up to there are queued already */
  r->wave[i] = (wave){.pin = pin,
                      .level = r->driven[pin] == BOARD_HIGH,
                      .half = half_cycles,
                      .next = start + half_cycles,
                      .end = start + duration};
  return SIM_OK;
}

int sim_hold_whisker(sim *self, int number, uint8_t pin, int held) {
  robot *r = find(self, number);
  if (r == NULL || held < -1 || held > 1) return SIM_BAD_ARGUMENT;
  for (int i = 0; i < r->whiskers; i++) {
    if (r->whisker[i].pin != pin) continue;
    r->whisker[i].held = held;
    return SIM_OK;
  }
  return SIM_BAD_ARGUMENT;
}

int sim_answer_ping(sim *self, int number, int64_t echo_cycles) {
  robot *r = find(self, number);
  if (r == NULL || r->pings == 0) return SIM_BAD_ARGUMENT;
  for (int i = 0; i < r->pings; i++) r->ping[i].answer = echo_cycles;
  return SIM_OK;
}

int sim_set_supply(sim *self, int number, double volts) {
  robot *r = find(self, number);
  if (r == NULL || !(volts >= 0.0)) return SIM_BAD_ARGUMENT;
  r->held_supply = volts / SUPPLY_NOMINAL_V;
  r->supply = supply_of(r);
  return SIM_OK;
}

/* ---- boards by address ------------------------------------------------------------------------------------------- */

int board_check(uintptr_t address) {
  const board *b = (const board *)address;
  return b != NULL && b->op != NULL && b->op->version == BOARD_INTERFACE_VERSION ? SIM_OK : SIM_WRONG_BOARD;
}

const char *board_kind(uintptr_t address) { return ((const board *)address)->op->kind; }

uint8_t board_output(uintptr_t address, uint8_t pin) {
  const board *b = (const board *)address;
  return pin < BOARD_PIN_COUNT ? b->op->output(b, pin) : (uint8_t)BOARD_RELEASED;
}

void board_destroy(uintptr_t address) {
  board *b = (board *)address;
  b->op->destroy(b);
}

const char *board_pin_map(uintptr_t address) {
  board *b = (board *)address;
  return b->op->extension(b, "pin_map");
}

void board_reset(uintptr_t address, int cause) {
  board *b = (board *)address;
  b->op->reset(b, (board_reset_cause)cause);
}

const char *board_fault(uintptr_t address) {
  const board *b = (const board *)address;
  return b->op->fault(b);
}

void board_read_counters(uintptr_t address, uint64_t counters[8]) {
  const board *b = (const board *)address;
  board_counters c = {0};
  b->op->counters(b, &c);
  const uint64_t values[8] = {c.executed_cycles, c.interrupts,     c.bytes_in, c.bytes_out,
                              c.overruns,        c.framing_errors, c.resets,   c.edges_out};
  memcpy(counters, values, sizeof values);
}
