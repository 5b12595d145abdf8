/* division.c: see division.h. */
#include "division.h"

#include "bounds.h"

uint32_t divide(uint16_t dividend, uint16_t divisor, uint8_t places) {
  uint32_t quotient = dividend / divisor;
  uint16_t rest = dividend % divisor;
  BOUNDED(DIVISION_PLACES_MAX, for (; places > 0; places--)) {
    quotient <<= 1;
    rest = (uint16_t)(rest << 1);
    if (rest >= divisor) {
      rest = (uint16_t)(rest - divisor);
      quotient++;
    }
  }
  return quotient;
}
