/* frame.c: see frame.h. */
#include "link/frame.h"

#include <string.h>

#include "hal/hal.h"
#include "link/crc21.h"

#define CHECK_BYTES 3u
#define INSIDE_MIN 6u /* code byte, id, sequence, checksum */

/* The register is kept in the top 21 of 24 bits, so that bytes enter from the left. */
typedef struct {
  uint8_t high, middle, low;
} crc21;

static inline crc21 crc_start(uint32_t seed) {
  const uint32_t aligned = seed << 3;
  return (crc21){(uint8_t)(aligned >> 16), (uint8_t)(aligned >> 8), (uint8_t)aligned};
}

static inline __attribute__((always_inline)) crc21 crc_byte(crc21 crc, uint8_t byte) {
  const uint8_t index = crc.high ^ byte;
  return (crc21){crc.middle ^ hal_table_byte(&crc21_high[index]), crc.low ^ hal_table_byte(&crc21_middle[index]),
                 hal_table_byte(&crc21_low[index])};
}

static crc21 crc_bytes(crc21 crc, const uint8_t *bytes, uint8_t count) {
  for (; count > 0; count--) {
    crc = crc_byte(crc, *bytes++);
  }
  return crc;
}

/* The three bytes that follow the stuffed ones. */
static inline void crc_spread(crc21 crc, uint8_t *check) {
  check[0] = (uint8_t)(0x80u | crc.high >> 1);
  check[1] = (uint8_t)(0x80u | (uint8_t)(crc.high << 6) | crc.middle >> 2);
  check[2] = (uint8_t)(0x80u | (uint8_t)(crc.middle << 5) | crc.low >> 3);
}

uint32_t frame_checksum(uint32_t seed, const uint8_t *bytes, uint8_t count) {
  const crc21 crc = crc_bytes(crc_start(seed), bytes, count);
  return ((uint32_t)crc.high << 16 | (uint32_t)crc.middle << 8 | crc.low) >> 3;
}

static inline uint32_t seed_of(uint8_t id, uint32_t session) { return message_is_handshake(id) ? FRAME_SEED : session; }

/* Bytes from `bytes` on up to the next zero or the end, and one more: what COBS writes in front of them. */
static inline uint8_t distance_to_zero(const uint8_t *bytes, uint8_t count) {
  uint8_t distance = 1;
  for (; count > 0 && *bytes != 0; count--) {
    bytes++;
    distance++;
  }
  return distance;
}

/* COBS: each zero, and the place before the first byte, becomes the distance to the next. Frames are too short for a
 * second code byte. One pass writes the bytes and takes them into the checksum. */
uint8_t frame_encode(uint8_t *wire, uint8_t id, uint8_t sequence, const void *payload, uint8_t length, uint32_t seed) {
  const uint8_t *bytes = payload;
  const crc21 start = crc_start(seed_of(id, seed));
  uint8_t distance = distance_to_zero(bytes, length);
  wire[0] = 0;
  wire[3] = sequence == 0 ? distance : sequence;
  distance = sequence == 0 ? 1u : (uint8_t)(distance + 1u);
  wire[2] = id == 0 ? distance : id;
  wire[1] = id == 0 ? 1u : (uint8_t)(distance + 1u);
  crc21 crc = crc_bytes(start, wire + 1, 3);
  uint8_t *to = wire + 4;
  for (uint8_t left = length; left > 0;) {
    uint8_t byte = *bytes++;
    left--;
    if (byte == 0) {
      byte = distance_to_zero(bytes, left);
    }
    crc = crc_byte(crc, byte);
    *to++ = byte;
  }
  crc_spread(crc, to);
  to[CHECK_BYTES] = 0;
  return (uint8_t)(length + FRAME_OVERHEAD);
}

/* Takes the stuffing off in place; false unless it ends exactly at `size`. */
static bool unstuff(uint8_t *bytes, uint8_t size) {
  uint8_t at = bytes[0];
  while (at < size) {
    const uint8_t step = bytes[at];
    bytes[at] = 0;
    if (step > (uint8_t)(size - at)) {
      return false;
    }
    at = (uint8_t)(at + step);
  }
  return at == size;
}

/* Whether what was collected is a message; leaves it unstuffed. */
static bool accept(frame_decoder *decoder) {
  if (decoder->count < INSIDE_MIN || decoder->count > FRAME_INSIDE_MAX || decoder->bytes[0] < 2) {
    return false;
  }
  const uint8_t size = (uint8_t)(decoder->count - CHECK_BYTES);
  const uint8_t id = decoder->bytes[1];
  if (frame_accepted_length(id) != (int16_t)(size - 3) ||
      (decoder->seed > FRAME_SEED_MAX && !message_is_handshake(id))) {
    return false;
  }
  uint8_t check[CHECK_BYTES];
  crc_spread(crc_bytes(crc_start(seed_of(id, decoder->seed)), decoder->bytes, size), check);
  return memcmp(check, &decoder->bytes[size], CHECK_BYTES) == 0 && unstuff(decoder->bytes, size);
}

void frame_decoder_start(frame_decoder *decoder, uint32_t seed) { *decoder = (frame_decoder){.seed = seed}; }

bool frame_decode_end(frame_decoder *decoder) {
  const bool empty = decoder->count == 0;
  const bool accepted = !empty && accept(decoder);
  if (accepted) {
    decoder->good++;
    decoder->resynchronised = (uint16_t)(decoder->resynchronised + decoder->lost);
    decoder->lost = false;
  } else if (!empty && decoder->synchronised) {
    decoder->bad++;
    decoder->lost = true;
  }
  decoder->count = 0;
  decoder->synchronised = true;
  return accepted;
}
