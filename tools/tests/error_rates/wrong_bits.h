/* wrong_bits.h: one frame between two others, with a stated number of wrong bits anywhere in its bytes, both delimiters
 * included. A wrong bit may make a delimiter of a byte or a byte of a delimiter. The decoder in C judges. */
#ifndef WRONG_BITS_H
#define WRONG_BITS_H

#include <stdint.h>

typedef struct {
  uint8_t id, sequence, length;
  uint8_t payload[64];
  uint32_t seed;
} wrong_bits_frame;

typedef struct {
  uint64_t patterns; /* sets of wrong bits tried */
  uint64_t accepted; /* patterns after which something was accepted that is neither neighbour */
  uint64_t lost;     /* patterns after which a neighbour was missing */
} wrong_bits_tally;

/* Every set of `bits` wrong bits. */
void wrong_bits_all(const wrong_bits_frame *frame, uint8_t bits, wrong_bits_tally *tally);

/* `count` random sets of `bits` wrong bits, up to 8. Every other set begins with a bit that makes or unmakes a delimiter,
 * where there is one. */
void wrong_bits_some(const wrong_bits_frame *frame, uint8_t bits, uint64_t count, uint64_t random,
                     wrong_bits_tally *tally);

#endif
