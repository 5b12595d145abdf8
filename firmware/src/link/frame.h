/* frame.h: messages to bytes on the wire and back (protocol/PROTOCOL.md, "Frame"). Portable C for any chip: no state but the
 * decoder's, nothing of the board.
 *
 *   wire = 00 . COBS(id, sequence, payload) . c2 c1 c0 . 00
 *
 * c2 c1 c0: CRC-21 of the stuffed bytes as on the wire, seven bits each under a set top bit, so that 00 occurs only as
 * the delimiter. A frame is accepted only if its length is exactly that of its id, its checksum is right, its
 * stuffing ends exactly at its end, and it is not the rest of a frame that a wrong bit has cut. Each frame has its own two
 * delimiters.
 *
 * Either end makes frames of both directions. The board's end accepts messages to the board; compiled with
 * -DFRAME_OF_HOST this is the host's end and accepts messages to the host. */
#ifndef FRAME_H
#define FRAME_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"

#define FRAME_SEED 0x155555ul         /* of the handshake's messages */
#define FRAME_SEED_MAX 0x1FFFFFul     /* seeds have 21 bits */
#define FRAME_NO_SESSION 0xFFFFFFFFul /* seed of a decoder that accepts only the handshake's messages */
#define FRAME_OVERHEAD 8u             /* bytes added to a payload, with both delimiters */

#if MESSAGE_PAYLOAD_MAX_TO_HOST > MESSAGE_PAYLOAD_MAX_TO_BOARD
#define FRAME_PAYLOAD_MAX MESSAGE_PAYLOAD_MAX_TO_HOST
#else
#define FRAME_PAYLOAD_MAX MESSAGE_PAYLOAD_MAX_TO_BOARD
#endif
#define FRAME_SIZE_MAX (FRAME_PAYLOAD_MAX + FRAME_OVERHEAD) /* longest frame of either direction */

#ifdef FRAME_OF_HOST
#define FRAME_ACCEPTED_MAX MESSAGE_PAYLOAD_MAX_TO_HOST
#define FRAME_ACCEPTED_IDS 0x80u /* their top bit */
static inline int16_t frame_accepted_length(uint8_t id) { return message_length_to_host(id); }
#else
#define FRAME_ACCEPTED_MAX MESSAGE_PAYLOAD_MAX_TO_BOARD
#define FRAME_ACCEPTED_IDS 0u
static inline int16_t frame_accepted_length(uint8_t id) { return message_length_to_board(id); }
#endif
#define FRAME_INSIDE_MAX (FRAME_ACCEPTED_MAX + FRAME_OVERHEAD - 2u) /* longest accepted between delimiters */

/* Writes the frame of a message to `wire` (FRAME_SIZE_MAX bytes); returns its length. The session's seed is used but for
 * the messages of the handshake, which keep FRAME_SEED. length <= FRAME_PAYLOAD_MAX */
uint8_t frame_encode(uint8_t *wire, uint8_t id, uint8_t sequence, const void *payload, uint8_t length, uint32_t seed);

typedef struct {
  uint32_t seed;           /* of the session, or FRAME_NO_SESSION */
  uint16_t good;           /* frames accepted, modulo 65536 */
  uint16_t bad;            /* frames refused, modulo 65536 */
  uint16_t unknown;        /* whole frames of messages that a later minor version has added, modulo 65536 */
  uint16_t resynchronised; /* times that a good frame followed bad ones, modulo 65536 */
  bool synchronised;       /* a delimiter was seen; what precedes the first is the tail of a frame joined late */
  bool lost;               /* the last frame was refused */
  bool begins;             /* an empty piece came before the bytes collected: a frame begins here */
  uint8_t used;            /* bytes of the piece before, and its delimiter */
  uint8_t whole;           /* bytes of the frame that it began by its id; 0: it began none that is known */
  uint8_t count;           /* bytes collected; above FRAME_INSIDE_MAX: too long to be a frame */
  uint8_t bytes[FRAME_INSIDE_MAX + 1u]; /* the last place shows that a piece is too long */
} frame_decoder;

void frame_decoder_start(frame_decoder *decoder, uint32_t seed);

/* Another session's seed, or FRAME_NO_SESSION; between frames. */
void frame_decoder_seed(frame_decoder *decoder, uint32_t seed);

/* Bytes are missing here: what was collected, and all up to the next delimiter, is not looked at. */
void frame_decoder_cut(frame_decoder *decoder);

/* Takes one byte; true when it ends a piece that is not empty: frame_decoder_accept() comes next. */
bool frame_decoder_take(frame_decoder *decoder, uint8_t byte);

/* Whether the piece that has ended is a message. Until the next byte its parts are in id, sequence and payload below. */
bool frame_decoder_accept(frame_decoder *decoder);

/* Both at once: takes one byte; true when it completes a message. */
static inline bool frame_decode(frame_decoder *decoder, uint8_t byte) {
  return frame_decoder_take(decoder, byte) && frame_decoder_accept(decoder);
}

static inline uint8_t frame_id(const frame_decoder *decoder) { return decoder->bytes[1]; }
static inline uint8_t frame_sequence(const frame_decoder *decoder) { return decoder->bytes[2]; }
static inline const uint8_t *frame_payload(const frame_decoder *decoder) { return &decoder->bytes[3]; }

#endif
