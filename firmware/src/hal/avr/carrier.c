/* carrier.c: the carrier of the IR bursts, by Timer2: its interrupt toggles the LED of one side, and looks at the receiver with
 * the last toggle. */
#include "hal/hal.h"

static volatile uint8_t side_on;
static volatile uint8_t toggles_left;
static volatile uint8_t left_level, right_level; /* the receivers' bits at the end of their last bursts */

ISR(TIMER2_COMPA_vect) {
  const uint8_t left = (uint8_t)(toggles_left - 1u);
  toggles_left = left;
  if (left == 0) {
    TIMSK2 = 0; /* not the timer alone: a match may have come while this toggle waited */
  }
  if (side_on == LEFT) {
    HAL_PIN_TOGGLE(INFRARED_LEFT_LED);
    left_level = INFRARED_LEFT_RECEIVER_PINR;
  } else {
    HAL_PIN_TOGGLE(INFRARED_RIGHT_LED);
    right_level = INFRARED_RIGHT_RECEIVER_PINR;
  }
}

void hal_burst_start(uint8_t side, uint8_t half_period, uint8_t toggles) {
  side_on = side;
  toggles_left = toggles;
  TCCR2A = _BV(WGM21);
  OCR2A = (uint8_t)(half_period - 1u);
  TCNT2 = 0;
  TIFR2 = _BV(OCF2A);
  TIMSK2 = _BV(OCIE2A);
  TCCR2B = _BV(CS20);
}

bool hal_burst_seen(uint8_t side) {
  const uint8_t high = side == LEFT ? left_level & HAL_PIN_BIT(INFRARED_LEFT_RECEIVER)
                                    : right_level & HAL_PIN_BIT(INFRARED_RIGHT_RECEIVER);
  return high == 0;
}
