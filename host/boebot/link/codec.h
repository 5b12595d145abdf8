/* codec.h: the firmware's own frame code (firmware/src/link/frame.h) for Python: whole buffers in, many messages out.
 *
 * Both ends are here: to_host accepts messages to the host, as a host does, to_board those to the board, as a board
 * does. A decoder belongs to one thread at a time. */
#ifndef CODEC_H
#define CODEC_H

#include <stddef.h>
#include <stdint.h>

/* python: begin */
/* Since the start, or since somebody set them. */
typedef struct {
  uint32_t good;           /* frames accepted */
  uint32_t bad;            /* frames refused: length, checksum, stuffing or seed */
  uint32_t unknown;        /* whole frames of messages that a later minor version has added: ignored */
  uint32_t resynchronised; /* times that a good frame followed bad ones */
  uint32_t lost;           /* frames that never came, by the gaps in the sequence numbers */
} codec_counts;

typedef struct codec_decoder codec_decoder;

codec_decoder *to_host_new(uint32_t seed); /* NULL: no memory */
codec_decoder *to_board_new(uint32_t seed);
void codec_free(codec_decoder *self);
codec_counts *codec_counts_of(codec_decoder *self);

/* Another session: its checksums, and a new count of sequence numbers. */
void to_host_seed(codec_decoder *self, uint32_t seed);
void to_board_seed(codec_decoder *self, uint32_t seed);

#define CODEC_SLICE 16384 /* the most bytes fed at once */
#define CODEC_FOUND 2341  /* the most messages that they complete: one for 7 bytes, and one begun before */

/* Messages in order: message i has its payload from ends[i - 1] (0 for the first) to ends[i] in payloads. */
typedef struct {
  uint8_t ids[2341];
  uint8_t sequences[2341];
  uint32_t ends[2341];
  char payloads[16448]; /* CODEC_SLICE and the rest of one begun before */
} codec_found;

/* Takes bytes as they come; returns how many messages they complete. size <= CODEC_SLICE */
uint32_t to_host_feed(codec_decoder *self, const uint8_t *bytes, uint32_t size, codec_found *found);
uint32_t to_board_feed(codec_decoder *self, const uint8_t *bytes, uint32_t size, codec_found *found);

/* The frame of a message of either direction, length + 8 bytes, until this thread's next call. length <= 60 */
const char *codec_encode(uint8_t id, uint8_t sequence, const uint8_t *payload, uint32_t length, uint32_t seed);

/* The three check bytes of stuffed bytes. */
void codec_check(uint8_t *check, const uint8_t *stuffed, uint32_t size, uint32_t seed);
/* python: end */

#endif
