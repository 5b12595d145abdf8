/* frame.c: see frame.h. */
#include "link/frame.h"

#include "bounds.h"
#include "link/crc21.h"

#define HEAD_BYTES 3u /* code byte, id, sequence */
#define CHECK_BYTES 3u
#define INSIDE_MIN (HEAD_BYTES + CHECK_BYTES)

/* Consistent overhead byte stuffing (Cheshire and Baker 1999) of frames, which are too short for a second code byte: each zero,
 * and the code byte before the first byte, becomes the distance to the next zero or to the end. In place; bytes[0] is the
 * code byte's place. */
static void stuff(uint8_t *bytes, uint8_t count) {
  uint8_t *code = bytes;
  uint8_t distance = 1;
  for (uint8_t i = 1; i < count; i++) {
    LOOP_BOUND(FRAME_PAYLOAD_MAX + HEAD_BYTES);
    if (bytes[i] == 0) {
      *code = distance;
      code = &bytes[i];
      distance = 0;
    }
    distance++;
  }
  *code = distance;
}

uint8_t frame_encode(uint8_t *wire, uint8_t id, uint8_t sequence, const void *payload, uint8_t length, uint32_t seed) {
  uint8_t *const inside = wire + 1;
  const uint8_t stuffed = (uint8_t)(length + HEAD_BYTES);
  wire[0] = 0;
  inside[1] = id;
  inside[2] = sequence;
  const uint8_t *from = payload;
  uint8_t *to = inside + HEAD_BYTES;
  for (uint8_t left = length; left != 0; left--) {
    LOOP_BOUND(FRAME_PAYLOAD_MAX);
    *to++ = *from++;
  }
  stuff(inside, stuffed);
  crc21 crc = crc21_start(message_is_handshake(id) ? FRAME_SEED : seed);
  for (to = inside; to != inside + stuffed; to++) {
    LOOP_BOUND(FRAME_PAYLOAD_MAX + HEAD_BYTES);
    crc21_add(&crc, *to);
  }
  crc21_put(crc, to);
  inside[stuffed + CHECK_BYTES] = 0;
  return (uint8_t)(length + FRAME_OVERHEAD);
}

/* Takes the stuffing off in place; false unless it ends exactly at the end. No byte of it is zero. */
static bool unstuff(uint8_t *bytes, uint8_t count) {
  uint8_t at = 0;
  while (at < count) {
    LOOP_BOUND(FRAME_ACCEPTED_MAX + HEAD_BYTES);
    const uint8_t step = bytes[at];
    bytes[at] = 0;
    if (step > count - at) {
      return false;
    }
    at = (uint8_t)(at + step);
  }
  return true;
}

static bool has_right_check(const uint8_t *bytes, uint8_t stuffed, uint32_t seed) {
  crc21 crc = crc21_start(seed);
  for (uint8_t i = 0; i < stuffed; i++) {
    LOOP_BOUND(FRAME_ACCEPTED_MAX + HEAD_BYTES);
    crc21_add(&crc, bytes[i]);
  }
  uint8_t right[CHECK_BYTES];
  crc21_put(crc, right);
  const uint8_t *check = bytes + stuffed;
  return check[0] == right[0] && check[1] == right[1] && check[2] == right[2];
}

/* A message that came with a later minor version may have any length. */
static bool has_right_length(uint8_t id, uint8_t length) {
  const int16_t right = frame_accepted_length(id);
  return right < 0 ? (id & 0x80u) == FRAME_ACCEPTED_IDS : right == (int16_t)length;
}

/* The code byte of a message is at least 2: its id is not zero. */
static bool is_message(frame_decoder *decoder, uint8_t count) {
  uint8_t *bytes = decoder->bytes;
  if (count < INSIDE_MIN || count > FRAME_INSIDE_MAX || bytes[0] < 2) {
    return false;
  }
  const uint8_t id = bytes[1];
  if (!has_right_length(id, (uint8_t)(count - INSIDE_MIN))) {
    return false;
  }
  const uint32_t seed = message_is_handshake(id) ? FRAME_SEED : decoder->seed;
  const uint8_t stuffed = (uint8_t)(count - CHECK_BYTES);
  return seed != FRAME_NO_SESSION && has_right_check(bytes, stuffed, seed) && unstuff(bytes, stuffed);
}

void frame_decoder_start(frame_decoder *decoder, uint32_t seed) { *decoder = (frame_decoder){.seed = seed}; }

void frame_decoder_seed(frame_decoder *decoder, uint32_t seed) { decoder->seed = seed; }

void frame_decoder_cut(frame_decoder *decoder) {
  decoder->count = 0;
  decoder->synchronised = decoder->begins = false;
}

bool frame_decoder_take(frame_decoder *decoder, uint8_t byte) {
  if (byte != 0) {
    if (decoder->count <= FRAME_INSIDE_MAX) {
      decoder->bytes[decoder->count] = byte;
      decoder->count++;
    }
    return false;
  }
  if (decoder->count != 0) {
    return true;
  }
  decoder->synchronised = true;
  decoder->begins = true;
  return false;
}

/* Bytes between the delimiters of the frame that a piece begins by its id; 0: it begins none that is known. */
static uint8_t begun_size(const frame_decoder *decoder, uint8_t count) {
  const int16_t length = decoder->begins && count > 1u ? frame_accepted_length(decoder->bytes[1]) : -1;
  return length < 0 ? 0 : (uint8_t)((uint8_t)length + INSIDE_MIN);
}

/* Whether a piece is the rest of a frame: of one that was joined late, or of one in which a wrong bit made a delimiter. Then
 * the piece before it, one delimiter away, began a frame that ends exactly with this one. Once in 2^21 the checksum of a rest
 * fits all the same. */
static bool is_rest(const frame_decoder *decoder, uint8_t count) {
  return !decoder->begins && (!decoder->synchronised || decoder->used + count == decoder->whole);
}

bool frame_decoder_accept(frame_decoder *decoder) {
  const uint8_t count = decoder->count;
  const bool synchronised = decoder->synchronised, rest = is_rest(decoder, count);
  decoder->whole = begun_size(decoder, count);
  decoder->used = (uint8_t)(count + 1u);
  decoder->count = 0;
  decoder->begins = false;
  decoder->synchronised = true;
  if (rest || !is_message(decoder, count)) {
    if (synchronised) {
      decoder->bad++;
      decoder->lost = true;
    }
    return false;
  }
  if (frame_accepted_length(frame_id(decoder)) < 0) {
    decoder->unknown++;
    return false;
  }
  decoder->good++;
  if (decoder->lost) {
    decoder->lost = false;
    decoder->resynchronised++;
  }
  return true;
}
