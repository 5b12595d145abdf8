/* c_decoder.c: see c_decoder.h. */
#include "c_decoder.h"

#include <stdlib.h>
#include <string.h>

#include "link/frame.h"

#define SESSION_ROUNDS 1000u /* rounds in one session */

struct c_decoder {
  frame_decoder decoder;
};

static void start(frame_decoder *decoder, uint32_t seed) {
  frame_decoder_start(decoder, seed);
  frame_decode(decoder, 0);
}

c_decoder *c_decoder_new(uint32_t seed) {
  c_decoder *self = malloc(sizeof *self);
  if (self != NULL) {
    start(&self->decoder, seed);
  }
  return self;
}

void c_decoder_free(c_decoder *self) { free(self); }

void c_decoder_seed(c_decoder *self, uint32_t seed) { frame_decoder_seed(&self->decoder, seed); }

size_t c_decoder_feed(c_decoder *self, const uint8_t *bytes, size_t count, c_decoder_message *found, size_t room) {
  size_t messages = 0;
  for (size_t i = 0; i < count; i++) {
    if (frame_decode(&self->decoder, bytes[i])) {
      if (messages < room) {
        c_decoder_message *message = &found[messages];
        message->id = frame_id(&self->decoder);
        message->sequence = frame_sequence(&self->decoder);
        message->length = (uint8_t)frame_accepted_length(message->id);
        memcpy(message->payload, frame_payload(&self->decoder), message->length);
      }
      messages++;
    }
  }
  return messages;
}

uint16_t c_decoder_good(const c_decoder *self) { return self->decoder.good; }

uint16_t c_decoder_bad(const c_decoder *self) { return self->decoder.bad; }

uint8_t c_decoder_encode(uint8_t *wire, uint8_t id, uint8_t sequence, const uint8_t *payload, uint8_t length,
                         uint32_t seed) {
  return frame_encode(wire, id, sequence, payload, length, seed);
}

void c_decoder_run(channel_fault fault, uint64_t rounds, uint64_t random, channel_tally *tally) {
  channel line;
  channel_round round;
  frame_decoder decoder;
  channel_start(&line, random);
  for (uint64_t i = 0; i < rounds; i++) {
    if (i % SESSION_ROUNDS == 0) {
      channel_session(&line, 0);
      start(&decoder, line.seed);
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
