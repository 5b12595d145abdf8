/* frame.c: see frame.h. */
#include "link/frame.h"

#include "hal/hal.h"
#include "link/crc21.h"

#define CHECK_BYTES 3u
#define INSIDE_MIN 6u /* code byte, id, sequence, checksum */

static inline crc21 crc_start(uint32_t seed) {
  const uint32_t aligned = seed << 3;
  return (crc21){(uint8_t)(aligned >> 16), (uint8_t)(aligned >> 8), (uint8_t)aligned};
}

/* The three bytes that follow the stuffed ones. */
static inline void crc_spread(crc21 crc, uint8_t *check) {
  check[0] = (uint8_t)(0x80u | crc.high >> 1);
  check[1] = (uint8_t)(0x80u | (uint8_t)(crc.high << 6) | crc.middle >> 2);
  check[2] = (uint8_t)(0x80u | (uint8_t)(crc.middle << 5) | crc.low >> 3);
}

uint32_t frame_checksum(uint32_t seed, const uint8_t *bytes, uint8_t count) {
  crc21 crc = crc_start(seed);
  if (count > 0) {
    crc21_take_all(&crc, bytes, count);
  }
  return ((uint32_t)crc.high << 16 | (uint32_t)crc.middle << 8 | crc.low) >> 3;
}

static inline uint32_t seed_of(uint8_t id, uint32_t session) { return message_is_handshake(id) ? FRAME_SEED : session; }

/* Bytes from `bytes` on up to the next zero or the end, and one more: what COBS writes in front of them. */
static inline __attribute__((always_inline)) uint8_t distance_to_zero(const uint8_t *bytes, uint8_t count) {
  const uint8_t whole = (uint8_t)(count + 1u);
  uint8_t left = whole;
  while (--left != 0 && *bytes++ != 0) {
  }
  return (uint8_t)(whole - left);
}

/* COBS: each zero, and the place before the first byte, becomes the distance to the next. Frames are too short for a
 * second code byte. The bytes between zeros are copied and taken into the checksum in one pass. */
uint8_t frame_encode(uint8_t *wire, uint8_t id, uint8_t sequence, const void *payload, uint8_t length, uint32_t seed) {
  const uint8_t *bytes = payload;
  uint8_t left = length;
  uint8_t distance = distance_to_zero(bytes, left);
  uint8_t run = (uint8_t)(distance - 1u);
  wire[0] = 0;
  wire[3] = sequence == 0 ? distance : sequence;
  distance = sequence == 0 ? 1u : (uint8_t)(distance + 1u);
  wire[2] = id == 0 ? distance : id;
  wire[1] = id == 0 ? 1u : (uint8_t)(distance + 1u);
  crc21 crc = crc_start(seed_of(id, seed));
  crc21_take_all(&crc, wire + 1, 3);
  uint8_t *to = wire + 4;
  for (;;) {
    if (run != 0) {
      crc21_copy(&crc, &to, &bytes, run);
      left = (uint8_t)(left - run);
    }
    if (left == 0) {
      break;
    }
    left--; /* a zero */
    bytes++;
    distance = distance_to_zero(bytes, left);
    crc21_take(&crc, distance);
    *to++ = distance;
    run = (uint8_t)(distance - 1u);
  }
  crc_spread(crc, to);
  to[CHECK_BYTES] = 0;
  return (uint8_t)(length + FRAME_OVERHEAD);
}

/* Takes the stuffing off in place; false unless it ends exactly at the end. count > 0 */
static inline bool unstuff(uint8_t *bytes, uint8_t count) {
  uint8_t step = *bytes;
  while (step < count) {
    count = (uint8_t)(count - step);
    bytes += step;
    step = *bytes;
    *bytes = 0;
  }
  return step == count;
}

/* Whether the three bytes carry that checksum. */
static inline bool crc_is(crc21 crc, const uint8_t *check) {
  uint8_t expected[CHECK_BYTES];
  crc_spread(crc, expected);
  return check[0] == expected[0] && check[1] == expected[1] && check[2] == expected[2];
}

/* Whether what was collected is a message; leaves it unstuffed. What is too long to be one has no id of that length. */
static inline bool accept(const frame_decoder *decoder, uint8_t *bytes, uint8_t count) {
  if (count < INSIDE_MIN || bytes[0] < 2) {
    return false;
  }
  const uint8_t id = bytes[1];
  if ((uint8_t)frame_accepted_length(id) != (uint8_t)(count - INSIDE_MIN)) {
    return false;
  }
  uint32_t seed = FRAME_SEED;
  if (!message_is_handshake(id)) {
    seed = decoder->seed;
    if (seed > FRAME_SEED_MAX) {
      return false;
    }
  }
  const uint8_t size = (uint8_t)(count - CHECK_BYTES);
  crc21 crc = crc_start(seed);
  crc21_take_all(&crc, bytes, size);
  return crc_is(crc, bytes + size) && unstuff(bytes, size);
}

void frame_decoder_start(frame_decoder *decoder, uint32_t seed) { *decoder = (frame_decoder){.seed = seed}; }

bool frame_decode_end(frame_decoder *decoder) {
  const uint8_t count = decoder->count;
  const bool synchronised = decoder->synchronised;
  decoder->count = 0;
  decoder->synchronised = true;
  if (count == 0) {
    return false;
  }
  if (accept(decoder, decoder->bytes, count)) {
    decoder->good++;
    if (decoder->lost) {
      decoder->lost = false;
      decoder->resynchronised++;
    }
    return true;
  }
  if (synchronised) {
    decoder->bad++;
    decoder->lost = true;
  }
  return false;
}
