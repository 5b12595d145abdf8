/* division.h: quotients with binary places by a division of 16 bits and steps of a longer one by hand: less flash and less time
 * than one of 32 bits. */
#ifndef DIVISION_H
#define DIVISION_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DIVISION_PLACES_MAX 18u

/* dividend * 2^places / divisor, rounded down, where that fits 32 bits. 0 < divisor < 32768 */
uint32_t divide(uint16_t dividend, uint16_t divisor, uint8_t places);

#ifdef __cplusplus
}
#endif

#endif
