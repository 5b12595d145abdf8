/* frame.h: messages to bytes on the wire and back (protocol/PROTOCOL.md, "Frame"). Portable C, no state but the
 * decoder's.
 *
 *   wire = 00 . COBS(id, sequence, payload) . c2 c1 c0 . 00
 *
 * c2 c1 c0: CRC-21 of the stuffed bytes as on the wire, seven bits each under a set top bit, so that 00 occurs only as
 * the delimiter. A frame is accepted only if its length is exactly that of its id, its checksum is right, and its
 * stuffing ends exactly at its end. Neighbours may share a delimiter; empty frames are nothing.
 *
 * Either end makes frames of both directions. The board's end accepts messages to the board; compiled with
 * -DFRAME_OF_HOST this is the host's end and accepts messages to the host. */
#ifndef FRAME_H
#define FRAME_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"
#include "holds_id.h"

#ifdef __cplusplus
extern "C" {
#endif

#define FRAME_SEED 0x155555ul         /* of the handshake's messages */
#define FRAME_NO_SESSION 0xFFFFFFFFul /* seed of a decoder that accepts only the handshake's messages */
#define FRAME_SEED_MAX 0x1FFFFFul     /* seeds have 21 bits */
#define FRAME_OVERHEAD 8u             /* bytes added to a payload, with both delimiters */

#if MESSAGE_PAYLOAD_MAX_TO_HOST > MESSAGE_PAYLOAD_MAX_TO_BOARD
#define FRAME_PAYLOAD_MAX MESSAGE_PAYLOAD_MAX_TO_HOST
#else
#define FRAME_PAYLOAD_MAX MESSAGE_PAYLOAD_MAX_TO_BOARD
#endif
#define FRAME_SIZE_MAX (FRAME_PAYLOAD_MAX + FRAME_OVERHEAD) /* longest frame of either direction */

#ifdef FRAME_OF_HOST
#define FRAME_ACCEPTED_MAX MESSAGE_PAYLOAD_MAX_TO_HOST
static inline int16_t frame_accepted_length(uint8_t id) { return message_length_to_host(id); }
#else
#define FRAME_ACCEPTED_MAX MESSAGE_PAYLOAD_MAX_TO_BOARD
static inline int16_t frame_accepted_length(uint8_t id) { return message_length_to_board(id); }
#endif
#define FRAME_INSIDE_MAX (FRAME_ACCEPTED_MAX + FRAME_OVERHEAD - 2u) /* longest accepted between delimiters */

/* CRC-21 of `count` bytes, after `seed`. */
uint32_t frame_checksum(uint32_t seed, const uint8_t *bytes, uint8_t count);

/* Writes the frame of a message to `wire` (FRAME_SIZE_MAX bytes, one after another as hal_serial_beyond() tells: on the
 * board its send ring); returns its length. The session's seed is used but
 * for the messages of the handshake, which keep FRAME_SEED. length <= FRAME_PAYLOAD_MAX */
uint8_t frame_encode(uint8_t *wire, uint8_t id, uint8_t sequence, const void *payload, uint8_t length, uint32_t seed);

typedef struct {
  uint32_t aligned;        /* the session's seed as the checksum's register has it; above 24 bits: there is none */
  uint16_t good;           /* frames accepted, modulo 65536 */
  uint16_t bad;            /* frames refused, modulo 65536 */
  uint16_t resynchronised; /* times that a good frame followed bad ones, modulo 65536 */
  bool synchronised;       /* a delimiter was seen; what precedes the first is the tail of a frame joined late */
  bool lost;               /* the last frame was refused */
  uint8_t count;           /* bytes collected; above FRAME_INSIDE_MAX: too long to be a frame */
  uint8_t bytes[FRAME_INSIDE_MAX + 2u]; /* the last place is for what is too long */
} frame_decoder;

void frame_decoder_start(frame_decoder *decoder, uint32_t seed);

/* Another session's seed, or FRAME_NO_SESSION; between frames. */
void frame_decoder_seed(frame_decoder *decoder, uint32_t seed);

/* A delimiter came: whether what was collected is a message. */
bool frame_decode_end(frame_decoder *decoder) __attribute__((noinline));

/* Takes one byte; true when it completes an accepted message. Until the next call its parts are in id, sequence and
 * payload below. */
static inline bool frame_decode(frame_decoder *decoder, uint8_t byte) {
  if (byte == 0) {
    return frame_decode_end(decoder);
  }
  decoder->bytes[decoder->count] = byte;
  if (decoder->count <= FRAME_INSIDE_MAX) {
    decoder->count++;
  }
  return false;
}

static inline uint8_t frame_id(const frame_decoder *decoder) {
  uint8_t id = decoder->bytes[1];
  HOLDS_ID(id);
  return id;
}
static inline uint8_t frame_sequence(const frame_decoder *decoder) { return decoder->bytes[2]; }
static inline const uint8_t *frame_payload(const frame_decoder *decoder) { return &decoder->bytes[3]; }

#ifdef __cplusplus
}
#endif

#endif
