/* snapshot.c: the state of one world as a hash and as bytes.
 *
 * One walk goes through all numbers that a world has come to, in one order; it hashes, writes, checks or reads them. What
 * follows from model, arena and the rest is not among them. Bytes are words of 64 bits, the lowest byte first, the same on
 * every machine. Format and checksum are saved.py's, whose FORMAT changes with the walk. */
#include <float.h>
#include <math.h>

#include "geometry/hash.h"
#include "vehicle.h"

#define LARGEST 1e12 /* of a state's numbers */
#define FASTEST 1e5  /* m/s, rad/s: a step's time goes with the speed */

enum { COUNT, HASH, WRITE, CHECK, READ };

typedef struct {
  int mode;
  int good;     /* CHECK */
  size_t count; /* of words so far */
  uint64_t sum; /* HASH */
  unsigned char *out;
  const unsigned char *in;
} stream;

static void put(unsigned char *bytes, size_t number, uint64_t word) {
  for (size_t i = 0; i < 8; i++) bytes[8 * number + i] = (unsigned char)(word >> (8 * i));
}

static uint64_t get(const unsigned char *bytes, size_t number) {
  uint64_t word = 0;
  for (size_t i = 0; i < 8; i++) word |= (uint64_t)bytes[8 * number + i] << (8 * i);
  return word;
}

/* ---- one value ---------------------------------------------------------------------------------------------------- */

/* The word that is now there, or was saved in its place. */
static uint64_t pass(stream *s, uint64_t now) {
  const size_t number = s->count++;
  if (s->mode == CHECK || s->mode == READ) return get(s->in, number);
  if (s->mode == HASH) s->sum = hash_word(s->sum, now);
  if (s->mode == WRITE) put(s->out, number, now);
  return now;
}

static void whole(stream *s, uint64_t *value, uint64_t least, uint64_t most) {
  const uint64_t found = pass(s, *value);
  if (s->mode == CHECK) s->good &= found >= least && found <= most;
  if (s->mode == READ) *value = found;
}

static void whole_int(stream *s, int *value, int most) {
  uint64_t wide = (uint64_t)*value;
  whole(s, &wide, 0, (uint64_t)most);
  if (s->mode == READ) *value = (int)wide;
}

static void number(stream *s, double *value, double most) {
  const uint64_t bits = pass(s, hash_bits(*value));
  double found;
  memcpy(&found, &bits, sizeof found);
  if (s->mode == CHECK) s->good &= fabs(found) <= most;
  if (s->mode == READ) *value = found;
}

#define NUMBERS(s, most, ...)                                                           \
  do {                                                                                  \
    double *const values[] = {__VA_ARGS__};                                             \
    for (size_t number_of = 0; number_of < sizeof values / sizeof *values; number_of++) \
      number((s), values[number_of], (most));                                           \
  } while (0)

/* ---- the walk ----------------------------------------------------------------------------------------------------- */

static void walk_body(stream *s, body_state *b) {
  NUMBERS(s, LARGEST, &b->x, &b->y);
  NUMBERS(s, FASTEST, &b->speed, &b->turn_rate, &b->lateral, &b->rim_left, &b->rim_right);
  NUMBERS(s, LARGEST, &b->wheel_left, &b->wheel_right, &b->distance, &b->touch_x, &b->touch_y);
  NUMBERS(s, 3.2, &b->heading);
  NUMBERS(s, 1.0 + 1e-9, &b->cosine, &b->sine);
  whole_int(s, &b->touching, 1);
  whole_int(s, &b->slipping, 1);
}

static void walk_state(stream *s, vehicle_state *v) {
  uint64_t id = v->id;
  int flag = v->flag;
  whole(s, &v->seed, 0, UINT64_MAX);
  whole(s, &id, 1, SCENE_FIRST_MOVER - 1);
  whole(s, &v->step, 0, UINT64_C(1) << 52);
  whole(s, &v->sensed, 0, (UINT64_C(1) << 52) + 1);
  whole(s, &v->next_pulse, 0, UINT64_C(1) << 53);
  whole_int(s, &flag, VEHICLE_BRAIN_FAILED);
  NUMBERS(s, 1.0, &v->signals[0], &v->signals[1], &v->energy);
  NUMBERS(s, LARGEST, &v->currents[0], &v->currents[1], &v->acceleration);
  for (int side = 0; side < 2; side++) {
    servo_motor *m = &v->servos[side];
    NUMBERS(s, LARGEST, &m->pulse_us, &m->age_s, &m->target, &m->reference);
  }
  if (s->mode != READ) return;
  v->id = (uint32_t)id;
  v->flag = flag;
}

/* Where a moving shape is follows from the time and how long it has waited. */
static void walk_mover(stream *s, mover *m) {
  NUMBERS(s, LARGEST, &m->waited);
  whole_int(s, &m->waits, 1);
}

static void walk_sensor(stream *s, const vehicle_sensor *sensor, sensor_slot *slot) {
  if (sensor->period > 0.0) NUMBERS(s, LARGEST, &slot->hold.next, &slot->hold.taken, &slot->hold.value);
  for (size_t k = 0; k < sensor->kind->numbers; k++) number(s, &slot->memory.numbers[k], LARGEST);
}

static void walk_brain(stream *s, unsigned char *memory, size_t size) {
  for (size_t at = 0; at < size; at += 8) {
    const uint64_t found = pass(s, get(memory + at, 0));
    if (s->mode == READ) put(memory + at, 0, found);
  }
}

static void walk(stream *s, vehicles *all, size_t i) {
  const vehicle_model *m = all->model;
  walk_body(s, &all->worlds[i].body.state);
  walk_state(s, &all->worlds[i].state);
  for (size_t k = 0; k < all->worlds[i].own.obstacles; k++) walk_mover(s, &all->worlds[i].own.movers[k]);
  for (size_t k = 0; k < m->sensors_count; k++) walk_sensor(s, &m->sensors[k], &all->slots[i * m->sensors_count + k]);
  for (size_t k = 0; k < m->readings; k++) number(s, &all->readings[i * m->readings + k], DBL_MAX);
  walk_brain(s, all->brains + i * all->state_size, all->state_size);
}

/* ---- what is offered ---------------------------------------------------------------------------------------------- */

uint64_t vehicles_hash(const vehicles *self, size_t i) {
  stream s = {.mode = HASH};
  walk(&s, (vehicles *)self, i); /* changes nothing */
  return s.sum;
}

size_t vehicles_snapshot_size(const vehicles *self, size_t i) {
  stream s = {.mode = COUNT};
  walk(&s, (vehicles *)self, i); /* changes nothing */
  return 8 * s.count;
}

void vehicles_save(const vehicles *self, size_t i, void *bytes) {
  stream s = {.mode = WRITE, .out = bytes};
  walk(&s, (vehicles *)self, i); /* changes nothing */
}

int vehicles_restore(vehicles *self, size_t i, const void *bytes, size_t size) {
  if (i >= self->count || self->worlds[i].in == NULL) return VEHICLE_NOT_PLACED;
  if (size != vehicles_snapshot_size(self, i)) return VEHICLE_BAD_SNAPSHOT;
  stream check = {.mode = CHECK, .good = 1, .in = bytes};
  walk(&check, self, i);
  if (!check.good) return VEHICLE_BAD_SNAPSHOT;
  vehicle *w = &self->worlds[i];
  stream s = {.mode = READ, .in = bytes};
  walk(&s, self, i);
  w->own.steps = w->state.step;
  w->body.id = w->state.id;
  const body_state saved = w->body.state;
  body_place(&w->body, saved.x, saved.y, saved.heading); /* forgets what was near */
  w->body.state = saved;
  for (size_t k = 0; k < self->model->sensors_count; k++)
    self->slots[i * self->model->sensors_count + k].key =
        noise_key(w->state.seed, w->state.id, self->model->sensors[k].device);
  vehicles_update_arena(self, i);
  return VEHICLE_OK;
}
