/* codec_end.h: one end's decoder. Included once by each end, with END(name) as prefix of its functions; the
 * firmware's functions get it too, since the two ends' versions of them are linked into one library. */
#define frame_encode END(frame_encode)
#define frame_decoder_start END(frame_decoder_start)
#define frame_decoder_seed END(frame_decoder_seed)
#define frame_decoder_cut END(frame_decoder_cut)
#define frame_decoder_take END(frame_decoder_take)
#define frame_decoder_accept END(frame_decoder_accept)
#include "link/frame.c"

#include <stdlib.h>
#include <string.h>

#include "codec.h"

#define ANY_SEQUENCE (-1)
#define COPY 255 /* the gap that the frame before leaves if it comes once more */
#define NO_ORIGIN UINT64_MAX

struct codec_decoder {
  codec_counts counts; /* first: codec_counts_of */
  int32_t next;        /* sequence number expected, or ANY_SEQUENCE */
  uint64_t origin;     /* what the numbers count from: the last hello's nonce and session; NO_ORIGIN: none yet */
  frame_decoder frames;
};

codec_decoder *END(new)(uint32_t seed) {
  codec_decoder *self = calloc(1, sizeof *self);
  if (self != NULL) {
    self->origin = NO_ORIGIN;
    END(seed)(self, seed);
  }
  return self;
}

void END(seed)(codec_decoder *self, uint32_t seed) {
  frame_decoder_seed(&self->frames, seed);
  self->next = ANY_SEQUENCE;
}

/* A board counts anew after its start, a host with each session that it opens. */
static bool counts_anew(codec_decoder *self) {
#ifdef FRAME_OF_HOST
  if (frame_id(&self->frames) != MSG_HELLO_ID) {
    return false;
  }
  msg_hello hello;
  memcpy(&hello, frame_payload(&self->frames), sizeof hello);
  const uint64_t origin = (uint64_t)hello.board_nonce << 32 | hello.session;
  const bool anew = origin != self->origin;
  self->origin = origin;
  return anew;
#else
  (void)self;
  return frame_id(&self->frames) == MSG_OPEN_ID;
#endif
}

static void count_lost(codec_decoder *self) {
  const uint8_t sequence = frame_sequence(&self->frames);
  const bool anew = counts_anew(self);
  const uint8_t gap = (uint8_t)(sequence - self->next);
  if (self->next != ANY_SEQUENCE && !anew && gap != COPY) {
    self->counts.lost += gap;
  }
  self->next = (uint8_t)(sequence + 1);
}

/* The firmware's counters roll over at 16 bits; these do not. */
static void take_counts(codec_decoder *self) {
  frame_decoder *frames = &self->frames;
  self->counts.good += frames->good;
  self->counts.bad += frames->bad;
  self->counts.unknown += frames->unknown;
  self->counts.resynchronised += frames->resynchronised;
  frames->good = frames->bad = frames->unknown = frames->resynchronised = 0;
}

_Static_assert(CODEC_FOUND >= CODEC_SLICE / 7 + 1, "room for the shortest frames");
_Static_assert(sizeof(((codec_found *)0)->ids) == CODEC_FOUND, "room for the shortest frames");
_Static_assert(sizeof(((codec_found *)0)->payloads) >= CODEC_SLICE + FRAME_PAYLOAD_MAX, "room for all payloads");

uint32_t END(feed)(codec_decoder *self, const uint8_t *bytes, uint32_t size, codec_found *found) {
  uint32_t count = 0, end = 0;
  for (uint32_t i = 0; i < size; i++) {
    if (frame_decode(&self->frames, bytes[i])) {
      const uint32_t length = (uint32_t)frame_accepted_length(frame_id(&self->frames));
      memcpy(found->payloads + end, frame_payload(&self->frames), length);
      end += length;
      found->ids[count] = frame_id(&self->frames);
      found->sequences[count] = frame_sequence(&self->frames);
      found->ends[count++] = end;
      count_lost(self);
    }
    if (self->frames.unknown != 0) {
      count_lost(self);
    }
    if (bytes[i] == 0) {
      take_counts(self);
    }
  }
  return count;
}
