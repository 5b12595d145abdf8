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

/* Takes bytes as they come; returns how many messages they complete. Message i: ids[i], sequences[i], and its payload
 * from ends[i - 1] (0 for the first) to ends[i] in payloads. size bytes complete at most size / 7 + 1 messages, with
 * payloads of size + 60 bytes. */
uint32_t to_host_feed(codec_decoder *self, const uint8_t *bytes, uint32_t size, uint8_t *ids, uint8_t *sequences,
                      uint32_t *ends, uint8_t *payloads);
uint32_t to_board_feed(codec_decoder *self, const uint8_t *bytes, uint32_t size, uint8_t *ids, uint8_t *sequences,
                       uint32_t *ends, uint8_t *payloads);

/* Writes a frame of either direction to `wire` (length + 8 bytes). length <= 60 */
uint32_t codec_encode(uint8_t *wire, uint8_t id, uint8_t sequence, const uint8_t *payload, uint32_t length,
                      uint32_t seed);

/* The three check bytes of stuffed bytes. size < 256 */
void codec_check(uint8_t *check, const uint8_t *stuffed, uint32_t size, uint32_t seed);
/* python: end */

#endif
