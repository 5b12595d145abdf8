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

static crc21 crc_bytes(crc21 crc, const uint8_t *bytes, uint8_t count) {
  uint8_t high = crc.high, middle = crc.middle, low = crc.low;
  for (; count > 0; count--) {
    const uint8_t index = high ^ *bytes++;
    high = middle ^ hal_table_byte(&crc21_high[index]);
    middle = low ^ hal_table_byte(&crc21_middle[index]);
    low = hal_table_byte(&crc21_low[index]);
  }
  return (crc21){high, middle, low};
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

static uint32_t seed_of(uint8_t id, uint32_t session) {
  switch (id) {
    case MSG_HELLO_REQUEST_ID:
    case MSG_HELLO_ID:
    case MSG_IDENTIFY_ID:
    case MSG_IDENTITY_ID:
      return FRAME_SEED;
    default:
      return session;
  }
}

uint8_t frame_encode(uint8_t *wire, uint8_t id, uint8_t sequence, const void *payload, uint8_t length, uint32_t seed) {
  uint8_t *body = wire + 2; /* after the delimiter and the first code byte */
  body[0] = id;
  body[1] = sequence;
  if (length > 0) { /* a message without fields has no payload */
    memcpy(body + 2, payload, length);
  }
  const uint8_t size = (uint8_t)(length + 2u);

  /* COBS: each zero, and the place before the first byte, becomes the distance to the next. Frames are too short for a
   * second code byte. */
  wire[0] = 0;
  uint8_t code = 1;
  for (uint8_t i = size; i-- > 0;) {
    if (body[i] == 0) {
      body[i] = code;
      code = 1;
    } else {
      code++;
    }
  }
  wire[1] = code;
  crc_spread(crc_bytes(crc_start(seed_of(id, seed)), wire + 1, (uint8_t)(size + 1u)), body + size);
  body[size + CHECK_BYTES] = 0;
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
  if (message_length(id) != (int16_t)(size - 3)) {
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
  if (!empty && !accepted && decoder->synchronised) {
    decoder->bad++;
  }
  decoder->count = 0;
  decoder->synchronised = true;
  return accepted;
}
