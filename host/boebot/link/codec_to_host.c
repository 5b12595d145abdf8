/* codec_to_host.c: the host's end of codec.h, and what both ends have in common. */
#define FRAME_OF_HOST
#define END(name) to_host_##name
#include "codec_end.h"

void codec_free(codec_decoder *self) { free(self); }

/* The counts are the first member at either end. */
codec_counts *codec_counts_of(codec_decoder *self) { return (codec_counts *)(void *)self; }

const char *codec_encode(uint8_t id, uint8_t sequence, const uint8_t *payload, uint32_t length, uint32_t seed) {
  static _Thread_local uint8_t wire[FRAME_SIZE_MAX];
  frame_encode(wire, id, sequence, payload, (uint8_t)length, seed);
  return (const char *)wire;
}

void codec_check(uint8_t *check, const uint8_t *stuffed, uint32_t size, uint32_t seed) {
  crc21 crc = crc21_start(seed);
  for (uint32_t i = 0; i < size; i++) {
    crc21_add(&crc, stuffed[i]);
  }
  crc21_put(crc, check);
}
