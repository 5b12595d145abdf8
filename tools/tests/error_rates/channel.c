/* channel.c: see channel.h. */
#include "channel.h"

#include <math.h>
#include <string.h>

#include "link/crc21.h"
#include "link/frame.h"

#define LIST_ROW(id, length, hash) {(id), (length)},
static const struct { uint8_t id, length; } ALL[] = {MESSAGE_LIST(LIST_ROW)};

uint64_t channel_random(uint64_t *state) {
  *state += 0x9E3779B97F4A7C15ull;
  uint64_t mixed = *state;
  mixed = (mixed ^ mixed >> 30) * 0xBF58476D1CE4E5B9ull;
  mixed = (mixed ^ mixed >> 27) * 0x94D049BB133111EBull;
  return mixed ^ mixed >> 31;
}

uint32_t channel_below(uint64_t *state, uint32_t limit) {
  return (uint32_t)((channel_random(state) >> 32) * limit >> 32);
}

static uint32_t below(channel *line, uint32_t limit) { return channel_below(&line->random, limit); }

/* From `least` to `greatest`, both included. */
static uint16_t between(channel *line, uint32_t least, uint32_t greatest) {
  return (uint16_t)(least + below(line, greatest - least + 1u));
}

/* ---- what is sent ---- */

void channel_start(channel *line, uint64_t random) {
  memset(line, 0, sizeof *line);
  line->random = random;
  for (size_t i = 0; i < MESSAGE_COUNT; i++) {
    if (frame_accepted_length(ALL[i].id) >= 0) {
      line->ids[line->kinds] = ALL[i].id;
      line->lengths[line->kinds] = ALL[i].length;
      line->kinds++;
    }
  }
  channel_session(line, 0);
}

void channel_only(channel *line, uint8_t id) {
  line->kinds = 1;
  line->ids[0] = id;
  line->lengths[0] = (uint8_t)frame_accepted_length(id);
  line->drawn = 1;
}

/* A seed of a session, unlike `other`. */
static uint32_t draw_seed(channel *line, uint32_t other) {
  uint32_t seed;
  do {
    seed = (uint32_t)channel_random(&line->random) & FRAME_SEED_MAX;
  } while (seed == 0 || seed == FRAME_SEED || seed == other);
  return seed;
}

void channel_session(channel *line, uint32_t seed) {
  const uint32_t last = line->seed;
  line->seed = seed != 0 ? seed : draw_seed(line, last);
  line->earlier = last != 0 && last != line->seed ? last : draw_seed(line, line->seed);
  line->sequence = (uint8_t)below(line, 256);
}

/* Zeros, ones, anything, or anything with many zeros: what is easy and what is hard for the stuffing. */
static void draw_payload(channel *line, uint8_t *payload, uint8_t length) {
  if (line->drawn != 0 && length == 2) {
    const uint16_t number = (uint16_t)(line->drawn * 40503u); /* odd, so that no two are alike */
    payload[0] = (uint8_t)number;
    payload[1] = (uint8_t)(number >> 8);
    line->drawn = line->drawn == 0xFFFF ? 1 : (uint16_t)(line->drawn + 1u);
    return;
  }
  const uint32_t style = below(line, 4);
  for (uint8_t i = 0; i < length; i++) {
    const uint64_t drawn = channel_random(&line->random);
    payload[i] = style == 0 ? 0 : style == 1 ? 0xFF : style == 2 || (drawn & 0x100) != 0 ? (uint8_t)drawn : 0;
  }
}

static void draw_frame(channel *line, channel_frame *frame) {
  const uint32_t kind = below(line, line->kinds);
  frame->id = line->ids[kind];
  frame->length = line->lengths[kind];
  frame->sequence = line->sequence++;
  frame->touched = frame->accepted = false;
  draw_payload(line, frame->payload, frame->length);
}

/* Writes a frame as the kit's senders do; returns its size. */
static uint16_t write_frame(uint8_t *wire, const channel_frame *frame, uint32_t seed) {
#ifdef CHANNEL_WITHOUT_LEADING_DELIMITER
  uint8_t whole[FRAME_SIZE_MAX];
  const uint8_t size = frame_encode(whole, frame->id, frame->sequence, frame->payload, frame->length, seed);
  memcpy(wire, whole + 1, size - 1u);
  return (uint16_t)(size - 1u);
#else
  return frame_encode(wire, frame->id, frame->sequence, frame->payload, frame->length, seed);
#endif
}

/* ---- faults: each takes the unspoilt bytes and puts onto round->wire what reaches the receiver ---- */

typedef struct {
  uint8_t bytes[CHANNEL_WIRE];
  uint16_t size;
} clean_line;

static void put(channel_round *round, const uint8_t *bytes, size_t count) {
  memcpy(&round->wire[round->size], bytes, count);
  round->size = (uint16_t)(round->size + count);
}

static void put_clean(channel_round *round, const clean_line *clean, uint16_t from, uint16_t to) {
  if (to > from) {
    put(round, &clean->bytes[from], (size_t)(to - from));
  }
}

/* The unspoilt bytes from `from` up to `to` do not arrive, or not as they were. */
static void touch(channel_round *round, uint16_t from, uint16_t to) {
  for (size_t i = 0; i < CHANNEL_FRAMES; i++) {
    channel_frame *frame = &round->sent[i];
    frame->touched = frame->touched || (from < frame->end && to > frame->start);
  }
}

/* Something came between the unspoilt bytes before and after `at`. */
static void touch_gap(channel_round *round, uint16_t at) {
  for (size_t i = 0; i < CHANNEL_FRAMES; i++) {
    channel_frame *frame = &round->sent[i];
    frame->touched = frame->touched || (at > frame->start && at < frame->end);
  }
}

/* One of the frames that have neighbours on both sides. */
static channel_frame *draw_inner(channel *line, channel_round *round) {
  return &round->sent[between(line, 1, CHANNEL_FRAMES - 2u)];
}

/* Inverts bits of the line, which has been put already. */
static void invert(channel_round *round, uint32_t bit) {
  round->wire[bit / 8u] ^= (uint8_t)(1u << bit % 8u);
  touch(round, (uint16_t)(bit / 8u), (uint16_t)(bit / 8u + 1u));
}

static double uniform(channel *line) { return ((double)(channel_random(&line->random) >> 11) + 0.5) * 0x1p-53; }

/* Distances between wrong bits are geometric; the first one's distribution is cut so that there is one in the round. */
static void bit_errors(channel *line, const clean_line *clean, channel_round *round, double probability) {
  const uint32_t bits = 8u * clean->size;
  const double right = log1p(-probability);
  const double any = -expm1(right * bits);
  put_clean(round, clean, 0, clean->size);
  for (uint32_t at = (uint32_t)(log1p(-uniform(line) * any) / right); at < bits;) {
    invert(round, at);
    const double step = log(uniform(line)) / right;
    at = step < (double)bits ? at + 1u + (uint32_t)step : bits;
  }
}

static void one_bit_in_10000(channel *line, const clean_line *clean, channel_round *round) {
  bit_errors(line, clean, round, 1e-4);
}

static void three_bits_in_1000(channel *line, const clean_line *clean, channel_round *round) {
  bit_errors(line, clean, round, 3e-3);
}

static void replace(channel_round *round, const clean_line *clean, uint16_t from, uint16_t to, const uint8_t *by,
                    size_t count) {
  put_clean(round, clean, 0, from);
  put(round, by, count);
  put_clean(round, clean, to, clean->size);
  if (to > from) {
    touch(round, from, to);
  } else {
    touch_gap(round, from);
  }
}

static void drop(channel *line, const clean_line *clean, channel_round *round) {
  const uint16_t from = between(line, round->sent[1].start, round->sent[CHANNEL_FRAMES - 2u].end - 1u);
  replace(round, clean, from, (uint16_t)(from + between(line, 1, 4)), NULL, 0);
}

static void insert(channel *line, const clean_line *clean, channel_round *round) {
  const channel_frame *frame = draw_inner(line, round);
  const uint16_t at = between(line, frame->start + 1u, frame->end - 1u);
  uint8_t extra[4];
  const size_t count = between(line, 1, 4);
  for (size_t i = 0; i < count; i++) {
    extra[i] = below(line, 4) == 0 ? 0 : (uint8_t)below(line, 256);
  }
  replace(round, clean, at, at, extra, count);
}

static void double_byte(channel *line, const clean_line *clean, channel_round *round) {
  const channel_frame *frame = draw_inner(line, round);
  const uint16_t at = between(line, frame->start, frame->end - 1u);
  uint8_t same[4];
  memset(same, clean->bytes[at], sizeof same);
  replace(round, clean, at, (uint16_t)(at + 1u), same, between(line, 2, 4));
}

static void burst(channel *line, const clean_line *clean, channel_round *round) {
  const uint16_t from = between(line, round->sent[1].start, round->sent[CHANNEL_FRAMES - 2u].end - 1u);
  const uint32_t first = 8u * from + below(line, 8);
  uint32_t last = first + between(line, 1, 63);
  last = last < 8u * clean->size ? last : 8u * clean->size - 1u;
  put_clean(round, clean, 0, clean->size);
  for (uint32_t bit = first; bit <= last; bit++) {
    if (bit == first || bit == last || below(line, 2) != 0) {
      invert(round, bit);
    }
  }
}

static void truncate_frame(channel *line, const clean_line *clean, channel_round *round) {
  const channel_frame *frame = draw_inner(line, round);
  replace(round, clean, between(line, frame->start + 1u, frame->end - 1u), frame->end, NULL, 0);
}

static void concatenate(channel *line, const clean_line *clean, channel_round *round) {
  const channel_frame *frame = &round->sent[between(line, 1, CHANNEL_FRAMES - 3u)];
  uint16_t cut = (uint16_t)(frame->end - 1u), resume = (uint16_t)(frame[1].start + 1u);
  if (below(line, 2) != 0) {
    cut = between(line, frame->start + 1u, frame->end - 1u);
    resume = between(line, frame[1].start + 1u, frame[1].end - 1u);
  }
  replace(round, clean, cut, resume, NULL, 0);
}

static void noise(channel *line, const clean_line *clean, channel_round *round) {
  static const uint8_t CONSTANTS[] = {0x00, 0xFF, 0x55, 0x01};
  uint8_t bytes[200];
  const size_t count = between(line, 1, sizeof bytes);
  const uint32_t style = below(line, 8);
  const uint8_t constant = style < sizeof CONSTANTS ? CONSTANTS[style] : (uint8_t)below(line, 256);
  for (size_t i = 0; i < count; i++) {
    bytes[i] = style < 6 ? constant : (uint8_t)below(line, 256);
  }
  /* over what was sent up to the last frame; what remains of the noise is time that the line was idle */
  const uint16_t from = between(line, round->sent[1].start, round->sent[CHANNEL_FRAMES - 2u].end - 1u);
  const uint16_t limit = round->sent[CHANNEL_FRAMES - 1u].start;
  const uint16_t to = from + count < limit ? (uint16_t)(from + count) : limit;
  replace(round, clean, from, to, bytes, count);
}

/* Where something can come between two frames, or sometimes into one. */
static uint16_t draw_place(channel *line, channel_round *round) {
  const channel_frame *frame = draw_inner(line, round);
  return below(line, 4) != 0 ? frame->start : between(line, frame->start + 1u, frame->end - 1u);
}

/* The handshake's messages carry nonces in their payload instead, which the session checks. */
static void draw_of_session(channel *line, channel_frame *frame) {
  do {
    draw_frame(line, frame);
    line->sequence--;
  } while (message_is_handshake(frame->id));
}

static void earlier_session(channel *line, const clean_line *clean, channel_round *round) {
  uint8_t bytes[3u * FRAME_SIZE_MAX];
  size_t size = 0;
  round->garbage = (uint8_t)between(line, 1, 3);
  for (size_t i = 0; i < round->garbage; i++) {
    channel_frame old;
    draw_of_session(line, &old);
    old.sequence = (uint8_t)below(line, 256);
    size += write_frame(&bytes[size], &old, line->earlier);
  }
  const size_t cut = below(line, 3) == 0 ? below(line, 8) : 0; /* what the buffer had lost */
  const bool head = below(line, 2) != 0;
  const uint16_t at = draw_place(line, round);
  replace(round, clean, at, at, head ? bytes + cut : bytes, size - cut);
}

/* The checksum of whatever stands between the delimiters, right. */
static size_t close_frame(uint8_t *wire, size_t stuffed, uint32_t seed) {
  crc21 crc = crc21_start(seed);
  wire[0] = 0;
  for (size_t i = 1; i <= stuffed; i++) {
    crc21_add(&crc, wire[i]);
  }
  crc21_put(crc, wire + 1u + stuffed);
  wire[stuffed + 4u] = 0;
  return stuffed + 5u;
}

static void foreign(channel *line, const clean_line *clean, channel_round *round) {
  uint8_t bytes[FRAME_SIZE_MAX + 1u];
  channel_frame made;
  size_t size;
  draw_of_session(line, &made);
  switch (below(line, 3)) {
    case 0: { /* a length that does not belong to the id */
      const uint8_t right = made.length;
      do {
        made.length = (uint8_t)below(line, FRAME_ACCEPTED_MAX + 1u);
      } while (made.length == right);
      draw_payload(line, made.payload, made.length);
      size = write_frame(bytes, &made, line->seed);
      break;
    }
    case 1: { /* the last block of the stuffing ends behind the frame */
      size = frame_encode(bytes, made.id, made.sequence, made.payload, made.length, line->seed) - 5u;
      size_t code = 1;
      while (code + bytes[code] < size + 1u) {
        code += bytes[code];
      }
      bytes[code] = (uint8_t)(bytes[code] + between(line, 1, 100));
      size = close_frame(bytes, size, line->seed);
      break;
    }
    default: /* an id that is no message to this side, whatever the length */
      do {
        made.id = (uint8_t)between(line, 1, 255);
      } while (frame_accepted_length(made.id) >= 0 || message_is_handshake(made.id));
      size = write_frame(bytes, &made, line->seed);
      break;
  }
  round->garbage = 1;
  const uint16_t at = draw_inner(line, round)->start;
  replace(round, clean, at, at, bytes, size);
}

typedef void fault_maker(channel *line, const clean_line *clean, channel_round *round);

static fault_maker *const FAULTS[CHANNEL_FAULTS] = {
    [CHANNEL_BITS_1E4] = one_bit_in_10000,
    [CHANNEL_BITS_3E3] = three_bits_in_1000,
    [CHANNEL_DROP] = drop,
    [CHANNEL_INSERT] = insert,
    [CHANNEL_DOUBLE] = double_byte,
    [CHANNEL_BURST] = burst,
    [CHANNEL_TRUNCATION] = truncate_frame,
    [CHANNEL_CONCATENATION] = concatenate,
    [CHANNEL_NOISE] = noise,
    [CHANNEL_EARLIER] = earlier_session,
    [CHANNEL_FOREIGN] = foreign,
};

void channel_send(channel *line, channel_fault fault, channel_round *round) {
  clean_line clean = {.size = 0};
  round->size = 0;
  round->garbage = round->next = round->wrong = 0;
  for (size_t i = 0; i < CHANNEL_FRAMES; i++) {
    channel_frame *frame = &round->sent[i];
    draw_frame(line, frame);
    frame->start = clean.size;
    clean.size = (uint16_t)(clean.size + write_frame(&clean.bytes[clean.size], frame, line->seed));
    frame->end = clean.size;
  }
  FAULTS[fault](line, &clean, round);
}

/* ---- the judge ---- */

void channel_accept(channel_round *round, uint8_t id, uint8_t sequence, const uint8_t *payload, uint8_t length) {
  for (uint8_t i = round->next; i < CHANNEL_FRAMES; i++) {
    channel_frame *frame = &round->sent[i];
    if (frame->id == id && frame->sequence == sequence && frame->length == length &&
        memcmp(frame->payload, payload, length) == 0) {
      frame->accepted = true;
      round->next = (uint8_t)(i + 1u);
      return;
    }
  }
  round->wrong++;
}

void channel_count(const channel_round *round, channel_tally *tally) {
  uint64_t damaged = round->garbage, lost = 0;
  for (size_t i = 0; i < CHANNEL_FRAMES; i++) {
    const channel_frame *frame = &round->sent[i];
    tally->accepted += frame->accepted;
    damaged += frame->touched && !frame->accepted;
    lost += !frame->touched && !frame->accepted;
  }
  tally->rounds++;
  tally->sent += CHANNEL_FRAMES;
  tally->damaged += damaged;
  tally->wrong += round->wrong;
  tally->lost += lost;
  tally->excess += lost > damaged;
}

/* ---- the decoder in C ---- */

void channel_run(channel_fault fault, uint64_t rounds, uint64_t random, channel_tally *tally) {
  channel line;
  channel_round round;
  frame_decoder decoder;
  channel_start(&line, random);
  for (uint64_t i = 0; i < rounds; i++) {
    if (i % CHANNEL_SESSION_ROUNDS == 0) {
      channel_session(&line, 0);
      frame_decoder_start(&decoder, line.seed);
      frame_decode(&decoder, 0);
    }
    channel_send(&line, fault, &round);
    for (uint16_t at = 0; at < round.size; at++) {
      if (frame_decode(&decoder, round.wire[at])) {
        const uint8_t id = frame_id(&decoder);
        channel_accept(&round, id, frame_sequence(&decoder), frame_payload(&decoder),
                       (uint8_t)frame_accepted_length(id));
      }
    }
    channel_count(&round, tally);
  }
}
