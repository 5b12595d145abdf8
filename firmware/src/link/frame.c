/* frame.c: see frame.h. */
#include "link/frame.h"

#include "hal/hal.h"
#include "link/cobs.h"
#include "link/crc21.h"

#define HEAD_BYTES 3u /* code byte, id, sequence */
#define CHECK_BYTES 3u
#define ACCEPTED_MAX (FRAME_ACCEPTED_MAX + HEAD_BYTES) /* stuffed, without its checksum */
#define INSIDE_MIN 6u                                  /* code byte, id, sequence, checksum */

/* The register that starts from a seed aligned with it. */
static inline crc21 crc_from(uint32_t aligned) {
  return (crc21){(uint8_t)(aligned >> 16), (uint8_t)(aligned >> 8), (uint8_t)aligned};
}

static inline crc21 crc_start(uint32_t seed) { return crc_from(crc21_align(seed)); }
_Static_assert(FRAME_NO_SESSION > 0xFFFFFFul && FRAME_SEED_MAX << 3 <= 0xFFFFFFul, "seeds and none");

uint32_t frame_checksum(uint32_t seed, const uint8_t *bytes, uint8_t count) {
  crc21 crc = crc_start(seed);
  if (count > 0) {
    crc21_take_all(&crc, bytes, count, UINT8_MAX);
  }
  return ((uint32_t)crc.high << 16 | (uint32_t)crc.middle << 8 | crc.low) >> 3;
}

uint8_t frame_encode(uint8_t *wire, uint8_t id, uint8_t sequence, const void *payload, uint8_t length, uint32_t seed) {
  *wire = 0;
  cobs_stuffing stuffing = {hal_serial_beyond(wire, (uint8_t)(length + 4u)), 1};
  if (length != 0) {
    cobs_put_all(&stuffing, (const uint8_t *)payload + length, length, FRAME_PAYLOAD_MAX);
  }
  cobs_put(&stuffing, sequence);
  cobs_put(&stuffing, id);
  hal_serial_put_before(&stuffing.to, stuffing.distance);
  crc21 crc = crc_start(message_is_handshake(id) ? FRAME_SEED : seed);
  crc21_take_sent(&crc, &stuffing.to, (uint8_t)(length + HEAD_BYTES), FRAME_PAYLOAD_MAX + HEAD_BYTES);
  crc21_spread(&crc);
  hal_serial_put(&stuffing.to, crc.high);
  hal_serial_put(&stuffing.to, crc.middle);
  hal_serial_put(&stuffing.to, crc.low);
  *stuffing.to = 0;
  return (uint8_t)(length + FRAME_OVERHEAD);
}

/* Whether what was collected is a message; leaves it unstuffed. What is too long to be one has no id of that length. */
static inline bool accept(const frame_decoder *decoder, uint8_t *bytes, uint8_t count) {
  if (count < INSIDE_MIN || bytes[0] < 2) {
    return false;
  }
  const uint8_t id = bytes[1];
  const uint8_t off = (uint8_t)((uint8_t)frame_accepted_length(id) - (uint8_t)(count - INSIDE_MIN));
  if (off != 0) {
    return false;
  }
  const uint32_t aligned = message_is_handshake(id) ? FRAME_SEED << 3 : decoder->aligned;
  if ((uint8_t)(aligned >> 24) != 0) { /* no session */
    return false;
  }
  crc21 crc = crc_from(aligned);
  const uint8_t size = (uint8_t)(count - CHECK_BYTES);
  crc21_take_all(&crc, bytes, size, ACCEPTED_MAX);
  crc21_spread(&crc);
  const uint8_t expected[CHECK_BYTES] = {crc.high, crc.middle, crc.low};
  const uint8_t *const check = bytes + size;
  /* branches, for a value made of them takes 14 bytes more */
  if (check[0] == expected[0] && check[1] == expected[1] && check[2] == expected[2] &&
      unstuff(bytes, size, ACCEPTED_MAX - 2u)) {
    return true;
  }
  return false;
}

void frame_decoder_start(frame_decoder *decoder, uint32_t seed) {
  *decoder = (frame_decoder){0};
  frame_decoder_seed(decoder, seed);
}

void frame_decoder_seed(frame_decoder *decoder, uint32_t seed) { decoder->aligned = crc21_align(seed); }

bool frame_decode_end(frame_decoder *decoder) {
  const uint8_t count = decoder->count;
  const bool synchronised = decoder->synchronised;
  decoder->count = 0;
  decoder->synchronised = true;
  if (count == 0) {
    return false;
  }
  if (!accept(decoder, decoder->bytes, count)) {
    if (synchronised) {
      decoder->bad++;
      decoder->lost = true;
    }
    return false;
  }
  decoder->good++;
  if (decoder->lost) {
    decoder->lost = false;
    decoder->resynchronised++;
  }
  return true;
}
