/* c_decoder.h: the decoder in C, by itself and at the end of the spoilt line. */
#ifndef C_DECODER_H
#define C_DECODER_H

#include <stddef.h>
#include <stdint.h>

#include "channel.h"

typedef struct {
  uint8_t id, sequence, length;
  uint8_t payload[CHANNEL_PAYLOAD];
} c_decoder_message;

typedef struct c_decoder c_decoder;

/* Behind a delimiter. NULL: no memory. */
c_decoder *c_decoder_new(uint32_t seed);
void c_decoder_free(c_decoder *self);
void c_decoder_seed(c_decoder *self, uint32_t seed);

/* Takes bytes; returns how many messages they completed, and writes at most `room` of them. */
size_t c_decoder_feed(c_decoder *self, const uint8_t *bytes, size_t count, c_decoder_message *found, size_t room);

/* Frames accepted and refused, modulo 65536. */
uint16_t c_decoder_good(const c_decoder *self);
uint16_t c_decoder_bad(const c_decoder *self);

/* The frame of a message with both delimiters; `wire` has room for the longest. Returns its length. */
uint8_t c_decoder_encode(uint8_t *wire, uint8_t id, uint8_t sequence, const uint8_t *payload, uint8_t length,
                         uint32_t seed);

/* Sends rounds with that fault to a new decoder and adds up what it made of them. */
void c_decoder_run(channel_fault fault, uint64_t rounds, uint64_t random, channel_tally *tally);

#endif
