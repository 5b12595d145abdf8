/* own_spi.h: chips on SPI whose bytes a callback supplies, a test's Python class (ATmega328P data sheet 19, from the
 * slave's side). One part for all at MISO, MOSI and SCK. Most significant bit first.
 */
#ifndef PART_OWN_SPI_H
#define PART_OWN_SPI_H

#include "part.h"

/* python: begin */
typedef struct own_spi own_spi;

/* The chip that is selected got a byte: returns what it sends while the next one comes. */
typedef int own_spi_answer(void *context, uint8_t byte, uint64_t cycle);

typedef struct {
  own_spi_answer *answer;
  void *context;
  own_spi **made; /* becomes the part that was made */
} own_spi_parameters;

/* From now on a chip is selected that sends `first` while the first byte comes, in SPI mode 0..3 (2: CPOL, 1: CPHA); or
 * none is: -1. */
void own_spi_select(own_spi *self, int mode, uint8_t first, uint64_t cycle);

/* Parameters: own_spi_parameters. Pins: MISO, MOSI, SCK. */
extern const part_kind own_spi_kind;
/* python: end */

#endif
