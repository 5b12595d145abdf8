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

static inline void crc_byte(crc21 *crc, uint8_t byte) {
  const uint8_t index = crc->high ^ byte;
  crc->high = crc->middle ^ hal_table_byte(&crc21_high[index]);
  crc->middle = crc->low ^ hal_table_byte(&crc21_middle[index]);
  crc->low = hal_table_byte(&crc21_low[index]);
}

/* The three bytes that follow the stuffed ones. */
static inline void crc_spread(crc21 crc, uint8_t *check) {
  check[0] = (uint8_t)(0x80u | crc.high >> 1);
  check[1] = (uint8_t)(0x80u | (uint8_t)(crc.high << 6) | crc.middle >> 2);
  check[2] = (uint8_t)(0x80u | (uint8_t)(crc.middle << 5) | crc.low >> 3);
}

uint32_t frame_checksum(uint32_t seed, const uint8_t *bytes, uint8_t count) {
  crc21 crc = crc_start(seed);
  for (uint8_t i = 0; i < count; i++) {
    crc_byte(&crc, bytes[i]);
  }
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
  memcpy(body + 2, payload, length);
  const uint8_t size = (uint8_t)(length + 2u);

  /* COBS: each zero, and the place before the first byte, becomes the distance to the next. Frames are too short for a
   * second code byte. */
  wire[0] = 0;
  crc21 crc = crc_start(seed_of(id, seed));
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
  for (uint8_t i = 0; i <= size; i++) {
    crc_byte(&crc, wire[1 + i]);
  }
  crc_spread(crc, body + size);
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
  crc21 crc = crc_start(seed_of(id, decoder->seed));
  for (uint8_t i = 0; i < size; i++) {
    crc_byte(&crc, decoder->bytes[i]);
  }
  uint8_t check[CHECK_BYTES];
  crc_spread(crc, check);
  return memcmp(check, &decoder->bytes[size], CHECK_BYTES) == 0 && unstuff(decoder->bytes, size);
}

void frame_decoder_start(frame_decoder *decoder, uint32_t seed) { *decoder = (frame_decoder){.seed = seed}; }

bool frame_decode(frame_decoder *decoder, uint8_t byte) {
  if (byte != 0) {
    if (decoder->count < FRAME_INSIDE_MAX) {
      decoder->bytes[decoder->count] = byte;
    }
    if (decoder->count <= FRAME_INSIDE_MAX) {
      decoder->count++;
    }
    return false;
  }
  const bool empty = decoder->count == 0;
  const bool accepted = !empty && accept(decoder);
  if (!empty && !accepted && decoder->synchronised) {
    decoder->bad++;
  }
  decoder->count = 0;
  decoder->synchronised = true;
  return accepted;
}
