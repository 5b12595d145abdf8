/* servo.c: the edges of the servo pulses and nothing else; what they mean is in motion.c. */
#include "servo.h"

#include <stdbool.h>

#include "hal/hal.h"
#include "pins.h"

#define RISE_OFFSET 8000u /* cycles from the slot's start to the rising edge: above the lead and any interrupt */

_Static_assert(RISE_OFFSET + 1700u * HAL_CYCLES_PER_US < HAL_SLOT_CYCLES - 2000u, "the longest pulse ends in its slot");

static volatile uint16_t wanted[SIDES];
static volatile uint16_t in_force[SIDES];
static uint8_t active; /* the side whose pulse is being made */
static bool high;
static uint16_t edge_time;

void servo_start(void) {
  HAL_PIN_LOW(SERVO_LEFT);
  HAL_PIN_LOW(SERVO_RIGHT);
  HAL_PIN_OUTPUT(SERVO_LEFT);
  HAL_PIN_OUTPUT(SERVO_RIGHT);
  wanted[LEFT] = wanted[RIGHT] = 0;
  in_force[LEFT] = in_force[RIGHT] = 0;
}

void servo_set(uint16_t left, uint16_t right) {
  HAL_ATOMIC {
    wanted[LEFT] = left;
    wanted[RIGHT] = right;
  }
}

uint16_t servo_pulse(uint8_t side) {
  uint16_t width = 0;
  HAL_ATOMIC { width = in_force[side]; }
  return width;
}

void servo_frame(void) {
  in_force[LEFT] = wanted[LEFT];
  in_force[RIGHT] = wanted[RIGHT];
}

void servo_begin(uint8_t side, uint16_t start) {
  if (in_force[side] == 0) {
    return;
  }
  active = side;
  high = false;
  edge_time = (uint16_t)(start + RISE_OFFSET);
  hal_edge_arm(edge_time);
}

void servo_edge(void) {
  hal_edge_wait(edge_time);
  if (active == LEFT) { /* the same way for both edges of a side, so that the width is exact */
    HAL_PIN_TOGGLE(SERVO_LEFT);
  } else {
    HAL_PIN_TOGGLE(SERVO_RIGHT);
  }
  if (high) {
    hal_edge_disarm();
    return;
  }
  high = true;
  edge_time = (uint16_t)(edge_time + hal_edge_delay(edge_time) + in_force[active]); /* a late pulse keeps its width */
  hal_edge_arm(edge_time);
}
