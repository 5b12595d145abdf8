/* frame_fuzzer.c: any bytes into the frame decoder, guided by coverage (libFuzzer), under the address and
 * undefined-behaviour sanitizers. The assertions say what must hold whatever the bytes:
 *
 *   an accepted message, encoded again, gives the same bytes;
 *   its length is that of its id, and nothing is collected beyond the longest frame;
 *   each piece between delimiters is counted once, as good, as bad or as unknown;
 *   a good frame behind two delimiters is accepted, whatever came before.
 *
 * An input is the seed (3 bytes) and the stream. Random bytes hardly ever have a right checksum, so the mutator rights that
 * of the last piece every other time; else nothing behind the checksum would be reached. */
#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "link/crc21.h"
#include "link/frame.h"

#define SEED_BYTES 3u
#define CHECK_BYTES 3u

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t size_max, unsigned random);
size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t size_max);

static uint32_t seed_of_input(const uint8_t *data) {
  return ((uint32_t)data[0] | (uint32_t)data[1] << 8 | (uint32_t)data[2] << 16) & FRAME_SEED_MAX;
}

/* The piece as it came, and how much of it. */
typedef struct {
  uint8_t bytes[FRAME_INSIDE_MAX + 1u];
  size_t count; /* more than fit are only counted */
} piece;

static void check_accepted(const frame_decoder *decoder, uint32_t seed, const piece *came) {
  const uint8_t id = frame_id(decoder);
  const int16_t length = frame_accepted_length(id);
  assert(length >= 0);
  assert(came->count == (size_t)length + FRAME_OVERHEAD - 2u);
  uint8_t again[FRAME_SIZE_MAX];
  const uint8_t size = frame_encode(again, id, frame_sequence(decoder), frame_payload(decoder), (uint8_t)length, seed);
  assert(size == came->count + 2u);
  assert(again[0] == 0 && again[size - 1u] == 0);
  assert(memcmp(again + 1, came->bytes, came->count) == 0);
}

/* The first message to this end, all of it zero. */
static uint8_t good_frame(uint8_t *wire, uint32_t seed) {
  static const uint8_t ZEROS[FRAME_PAYLOAD_MAX];
  uint8_t id = 1;
  while (frame_accepted_length(id) < 0) {
    id++;
  }
  return frame_encode(wire, id, 1, ZEROS, (uint8_t)frame_accepted_length(id), seed);
}

static void check_good_frame_is_accepted(frame_decoder *decoder, uint32_t seed) {
  uint8_t wire[FRAME_SIZE_MAX];
  const uint8_t size = good_frame(wire, seed);
  size_t accepted = 0;
  frame_decode(decoder, 0);
  for (uint8_t i = 0; i < size; i++) {
    accepted += frame_decode(decoder, wire[i]);
  }
  assert(accepted == 1);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  if (size < SEED_BYTES) {
    return -1;
  }
  frame_decoder *decoder = malloc(sizeof *decoder); /* so that a byte beyond its end is seen */
  assert(decoder != NULL);
  const uint32_t seed = seed_of_input(data);
  frame_decoder_start(decoder, seed);
  frame_decode(decoder, 0);
  piece came = {.count = 0};
  uint16_t pieces = 0;
  for (size_t i = SEED_BYTES; i < size; i++) {
    const bool accepted = frame_decode(decoder, data[i]);
    assert(decoder->count <= FRAME_INSIDE_MAX + 1u);
    if (data[i] != 0) {
      assert(!accepted);
      if (came.count < sizeof came.bytes) {
        came.bytes[came.count] = data[i];
      }
      came.count++;
      continue;
    }
    if (accepted) {
      check_accepted(decoder, seed, &came);
    }
    pieces = (uint16_t)(pieces + (came.count > 0));
    assert((uint16_t)(decoder->good + decoder->bad + decoder->unknown) == pieces);
    came.count = 0;
  }
  check_good_frame_is_accepted(decoder, seed);
  free(decoder);
  return 0;
}

/* Ends the stream with a delimiter, and gives the piece before it a right checksum. */
static size_t right_checksum(uint8_t *data, size_t size, size_t size_max) {
  size_t end = size > SEED_BYTES && data[size - 1u] == 0 ? size - 1u : size;
  if (end == size && size == size_max) {
    return size;
  }
  data[end] = 0;
  size_t start = end;
  while (start > SEED_BYTES && data[start - 1u] != 0) {
    start--;
  }
  const size_t count = end - start;
  if (count > CHECK_BYTES && count <= FRAME_INSIDE_MAX) {
    const size_t check = end - CHECK_BYTES;
    crc21 crc = crc21_start(message_is_handshake(data[start + 1u]) ? FRAME_SEED : seed_of_input(data));
    for (size_t i = start; i < check; i++) {
      crc21_add(&crc, data[i]);
    }
    crc21_put(crc, &data[check]);
  }
  return end + 1u;
}

size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t size_max, unsigned random) {
  const size_t mutated = LLVMFuzzerMutate(data, size, size_max);
  return random % 2u != 0 && mutated > SEED_BYTES ? right_checksum(data, mutated, size_max) : mutated;
}
