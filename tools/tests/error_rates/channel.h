/* channel.h: a serial line with faults, and the judge of what a receiver accepted from it. It serves every receiver: the
 * firmware's C, the host library's Python, the image in the emulated board. library.py declares all of this to Python.
 *
 * A round is a handful of frames on the line and one fault among them. A round knows what was sent, which frames the
 * fault touched, and which whole pieces it added that nobody sent in this session (garbage).
 *
 * Judgement. What the receiver accepts must be a frame of the round that has not been passed over: byte by byte the id,
 * sequence number and payload of one that was sent, in the order of sending, each once. Anything else is a wrong frame.
 * A touched frame that was not accepted is a damaged one; an untouched frame that was not accepted is lost. */
#ifndef CHANNEL_H
#define CHANNEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define CHANNEL_FRAMES 4u
#define CHANNEL_WIRE 1024u
#define CHANNEL_PAYLOAD 64u
#define CHANNEL_SESSION_ROUNDS 1000u /* rounds in one session of a run */

typedef enum {
  CHANNEL_BITS_1E4,      /* each bit wrong with a probability of 1e-4; rounds without a wrong bit are passed over */
  CHANNEL_BITS_3E3,      /* the same with 3e-3 */
  CHANNEL_DROP,          /* 1 to 4 bytes in a row are missing */
  CHANNEL_INSERT,        /* 1 to 4 bytes too many inside a frame, one in four of them a zero */
  CHANNEL_DOUBLE,        /* one byte comes two to four times */
  CHANNEL_BURST,         /* 2 to 64 bits in a row, each wrong or not, the first and the last wrong */
  CHANNEL_TRUNCATION,    /* a frame ends early, without its delimiter */
  CHANNEL_CONCATENATION, /* the head of one frame and the tail of the next make one piece */
  CHANNEL_NOISE,         /* 1 to 200 bytes of noise, constant (0x00, 0xFF, 0x55, any) or random, over what was sent */
  CHANNEL_EARLIER,       /* 1 to 3 frames of an earlier session, the first or last of them cut */
  CHANNEL_FOREIGN,       /* a frame with a right checksum but a wrong length, stuffing or id */
  CHANNEL_FAULTS
} channel_fault;

typedef struct {
  uint8_t id, sequence, length;
  uint8_t payload[CHANNEL_PAYLOAD];
  uint16_t start, end; /* of its bytes, delimiters included, on the unspoilt line */
  bool touched, accepted;
} channel_frame;

typedef struct {
  uint16_t size; /* bytes that reach the receiver */
  uint8_t wire[CHANNEL_WIRE];
  channel_frame sent[CHANNEL_FRAMES];
  uint8_t garbage; /* pieces added that nobody sent in this session */
  uint8_t next;    /* frames before it are accepted or passed over */
  uint8_t wrong;
} channel_round;

typedef struct {
  uint64_t random;
  uint32_t seed;    /* of the session */
  uint32_t earlier; /* of the session before */
  uint8_t sequence;
  uint8_t kinds;  /* messages that are sent */
  uint16_t drawn; /* payloads so far, if each is to be unlike the others; else 0 */
  uint8_t ids[32], lengths[32];
} channel;

typedef struct {
  uint64_t rounds;
  uint64_t sent;
  uint64_t damaged; /* frames not accepted because touched, and pieces of garbage */
  uint64_t accepted;
  uint64_t wrong;
  uint64_t lost;   /* untouched frames */
  uint64_t excess; /* rounds in which more untouched frames were lost than damaged */
} channel_tally;

/* A line to the receiver that this was compiled for; `random` decides on everything that happens on it. Sessions begin
 * with channel_session(). */
void channel_start(channel *line, uint64_t random);

/* Sends only this message from now on, whose payload is to be two bytes, unlike those of the 65534 frames before. */
void channel_only(channel *line, uint8_t id);

/* A new session; draws its seed, or takes `seed` unless that is 0. */
void channel_session(channel *line, uint32_t seed);

/* Sends a round with that fault. */
void channel_send(channel *line, channel_fault fault, channel_round *round);

/* The receiver accepted a message with a payload of `length` bytes. */
void channel_accept(channel_round *round, uint8_t id, uint8_t sequence, const uint8_t *payload, uint8_t length);

/* The receiver has had all of the round. */
void channel_count(const channel_round *round, channel_tally *tally);

/* Sends rounds with that fault to a new decoder in C and adds up what it made of them. */
void channel_run(channel_fault fault, uint64_t rounds, uint64_t random, channel_tally *tally);

/* Next number of a random sequence, 64 bits (splitmix64, Steele, Lea and Flood 2014). */
uint64_t channel_random(uint64_t *state);

/* From 0 on, below `limit`. */
uint32_t channel_below(uint64_t *state, uint32_t limit);

#endif
