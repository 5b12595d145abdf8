/* inputs.c: see loop.h. Here: what comes from outside is noted with its cycle, and played again.
 *
 * A run is a function of the simulation as it was built and of these inputs, so that playing them again leads to the same
 * state, bit for bit. An input is noted as
 *
 *     cycle (8 bytes), robot (4), kind (4), count of words (4), count of bytes (4), words (8 each), bytes
 *
 * with all numbers little-endian and doubles as their IEEE 754 bits.
 */
#include <string.h>

#include "state.h"

#define HEADING_BYTES 24u

/* ---- noting ------------------------------------------------------------------------------------------------------- */

static void put(uint8_t *out, uint64_t value, size_t size) {
  for (size_t i = 0; i < size; i++) out[i] = (uint8_t)(value >> 8 * i);
}

static uint64_t got(const uint8_t *in, size_t size) {
  uint64_t value = 0;
  for (size_t i = 0; i < size; i++) value |= (uint64_t)in[i] << 8 * i;
  return value;
}

uint64_t input_of_double(double value) {
  uint64_t word;
  memcpy(&word, &value, sizeof word);
  return word;
}

static double double_of_input(uint64_t word) {
  double value;
  memcpy(&value, &word, sizeof value);
  return value;
}

void sim_note(sim *self, int number, input_kind kind, const uint64_t *words, size_t count, const uint8_t *bytes,
              size_t size) {
  if (self->inputs.lost > 0) return; /* with a gap they are of no use */
  uint8_t fixed[HEADING_BYTES + 8 * INPUT_WORDS];
  put(fixed, self->now, 8);
  put(fixed + 8, (uint32_t)number, 4);
  put(fixed + 12, kind, 4);
  put(fixed + 16, count, 4);
  put(fixed + 20, size, 4);
  for (size_t i = 0; i < count; i++) put(fixed + HEADING_BYTES + 8 * i, words[i], 8);
  const size_t head = HEADING_BYTES + 8 * count;
  uint8_t *room = buffer_room(&self->inputs, head + size); /* as a whole, or not at all */
  if (room == NULL) {
    self->inputs.lost += head + size;
    return;
  }
  memcpy(room, fixed, head);
  if (size > 0) memcpy(room + head, bytes, size);
  self->inputs.count += head + size;
}

const uint8_t *sim_inputs(const sim *self, size_t *count) {
  static const uint8_t nothing[1] = {0};
  *count = self->inputs.count;
  if (self->inputs.lost > 0 || self->crashed) return NULL;
  return self->inputs.count > 0 ? self->inputs.data + self->inputs.start : nothing;
}

void sim_keep_no_inputs(sim *self) {
  buffer_free(&self->inputs);
  self->inputs.lost = 1;
}

/* ---- playing again ------------------------------------------------------------------------------------------------- */

typedef struct {
  uint64_t cycle;
  int number;
  uint32_t kind, words, size;
  uint64_t word[INPUT_WORDS];
  const uint8_t *bytes;
} input;

/* The input at the front of `bytes`. Returns its length there, 0 if it is none. */
static size_t read_input(const uint8_t *bytes, size_t size, input *out) {
  if (size < HEADING_BYTES) return 0;
  out->cycle = got(bytes, 8);
  out->number = (int)got(bytes + 8, 4);
  out->kind = (uint32_t)got(bytes + 12, 4);
  out->words = (uint32_t)got(bytes + 16, 4);
  out->size = (uint32_t)got(bytes + 20, 4);
  if (out->words > INPUT_WORDS || size - HEADING_BYTES < 8u * out->words) return 0;
  const size_t head = HEADING_BYTES + 8u * out->words;
  if (size - head < out->size) return 0;
  memset(out->word, 0, sizeof out->word);
  for (size_t i = 0; i < out->words; i++) out->word[i] = got(bytes + HEADING_BYTES + 8 * i, 8);
  out->bytes = bytes + head;
  return head + out->size;
}

static int apply(sim *self, const input *in) {
  const uint64_t *w = in->word;
  const int n = in->number;
  switch (in->kind) {
    case INPUT_SEND:
      return sim_send(self, n, in->bytes, in->size);
    case INPUT_LINE_RATE:
      return sim_line_rate(self, n, (uint32_t)w[0]);
    case INPUT_PLACE:
      return sim_place(self, n, double_of_input(w[0]), double_of_input(w[1]), double_of_input(w[2]));
    case INPUT_SHAPE:
      return sim_place_shape(self, n, double_of_input(w[0]), double_of_input(w[1]), double_of_input(w[2]));
    case INPUT_DRIVE:
      return sim_drive(self, n, w[0], (uint8_t)w[1], (uint8_t)w[2]);
    case INPUT_WAVE:
      return sim_wave(self, n, (uint8_t)w[0], (uint32_t)w[1], w[2]);
    case INPUT_WHISKER:
      return sim_hold_whisker(self, n, (uint8_t)w[0], (int)(int64_t)w[1]);
    case INPUT_PING:
      return sim_answer_ping(self, n, (int64_t)w[0]);
    case INPUT_UNPLUG:
      return sim_unplug(self, n, (uint8_t)w[0], (int)w[1]);
    case INPUT_SUPPLY:
      return sim_set_supply(self, n, double_of_input(w[0]));
    case INPUT_BROWN_OUT: {
      const brown_out_parameters p = {.reset_v = double_of_input(w[0]),
                                      .hysteresis_v = double_of_input(w[1]),
                                      .erratic_v = double_of_input(w[2]),
                                      .upsets_per_s = double_of_input(w[3])};
      return sim_set_brown_out(self, n, &p);
    }
    case INPUT_RESET:
      return sim_reset(self, n, (int)w[0]);
    case INPUT_EEPROM:
      return sim_write_eeprom(self, n, (uint32_t)w[0], in->bytes, in->size);
    case INPUT_DAMAGE:
      return sim_damage_eeprom(self, n, (int)w[0], (uint8_t)w[1]);
    case INPUT_SIGNALS:
      return sim_signals(self, n, double_of_input(w[0]), double_of_input(w[1]));
    case INPUT_MEMORY:
      return sim_write_memory(self, n, (uint32_t)w[0], in->bytes, in->size);
    default:
      return SIM_BAD_ARGUMENT;
  }
}

/* Nobody's bytes end a run now. */
static int run_deaf(sim *self, uint64_t until) {
  for (int i = 0; i < self->robot_count; i++) self->robots[i]->listen_from = SIM_NEVER;
  return sim_run_until(self, until);
}

int sim_replay(sim *self, const uint8_t *inputs, size_t size, size_t *at, uint64_t until) {
  while (*at < size) {
    input in;
    const size_t length = read_input(inputs + *at, size - *at, &in);
    if (length == 0 || in.cycle < self->now) return SIM_BAD_ARGUMENT;
    if (in.cycle > until) break;
    const int crashed = run_deaf(self, in.cycle);
    if (crashed != 0) return crashed;
    if (apply(self, &in) != SIM_OK) return SIM_BAD_ARGUMENT;
    *at += length;
  }
  return run_deaf(self, until);
}

void sim_forget_received(sim *self, int number, size_t keep) {
  robot *r = sim_robot(self, number);
  if (r == NULL || r->received.count <= keep) return;
  r->received.start += r->received.count - keep;
  r->received.count = keep;
}

/* ---- the state as a number ---------------------------------------------------------------------------------------- */

static uint64_t mixed(uint64_t sum, const void *bytes, size_t size) {
  const uint8_t *at = bytes;
  for (size_t i = 0; i < size; i += 8) sum = hash_mix(sum ^ got(at + i, size - i < 8 ? size - i : 8));
  return sum;
}

static uint64_t mixed_edges(uint64_t sum, const edge_log *log) {
  const uint64_t kept = log->count < log->capacity ? log->count : log->capacity;
  for (uint64_t i = log->count - kept; i < log->count; i++) {
    const sim_edge *e = &log->edges[i & (log->capacity - 1)];
    sum = hash_mix(sum ^ e->cycle ^ (uint64_t)e->pin << 56 ^ (uint64_t)e->level << 48);
  }
  return hash_mix(sum ^ log->count);
}

/* Of a board what can be had: what it counted and did to its pins, its EEPROM, and its data space if it has one. */
static uint64_t mixed_board(uint64_t sum, const robot *r) {
  board *b = r->board;
  board_counters c = {0};
  b->op->counters(b, &c);
  const uint64_t counted[] = {b->op->now(b), c.interrupts,     c.bytes_in, c.bytes_out, c.executed_cycles,
                              c.overruns,    c.framing_errors, c.resets,   c.edges_out, r->last_byte};
  for (size_t i = 0; i < sizeof counted / sizeof *counted; i++) sum = hash_mix(sum ^ counted[i]);
  const board_eeprom *eeprom = b->op->extension(b, BOARD_EEPROM);
  if (eeprom != NULL) sum = mixed(sum, eeprom->bytes, BOARD_EEPROM_SIZE);
  const uint8_t *data = b->op->extension(b, BOARD_DATA);
  if (data != NULL) sum = mixed(sum, data, BOARD_DATA_SIZE);
  return mixed_edges(sum, &r->edges);
}

uint64_t sim_state_hash(const sim *self) {
  uint64_t sum = hash_mix(self->now) ^ sim_hash(self);
  for (int i = 0; i < self->robot_count; i++) {
    const robot *r = self->robots[i];
    const double volts[] = {r->chassis.supply, r->battery == NULL ? 0.0 : r->battery->supply.pack_v};
    for (int k = 0; k < 2; k++) sum = hash_mix(sum ^ input_of_double(volts[k]));
    sum = hash_mix(sum ^ r->contacts);
    sum = r->vehicle != NULL ? hash_mix(sum ^ vehicles_hash(r->vehicle, 0)) : mixed_board(sum, r);
  }
  for (size_t k = 0; k < self->world.obstacles; k++) {
    const mover *m = &self->movers[k];
    const double off[] = {m->waited, m->shift_x, m->shift_y, m->shift_heading};
    for (int n = 0; n < 4; n++) sum = hash_mix(sum ^ input_of_double(off[n]));
  }
  return sum;
}
