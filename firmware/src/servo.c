/* servo.c: the edges of the servo pulses and nothing else; what they mean is in motion.c. */
#include "servo.h"

#include "hal/hal.h"
#include "hal/interrupts.h"

#define RISE_OFFSET 10000u /* cycles from the slot's start to the rising edge: above the lead and any interrupt */

_Static_assert(RISE_OFFSET + 1700u * HAL_CYCLES_PER_US < HAL_SLOT_CYCLES - 2000u, "the longest pulse ends in its slot");
_Static_assert(RISE_OFFSET + SERVO_TURRET_MAX < 2ul * HAL_SLOT_CYCLES - 2000u, "the turret's ends in the next");

static volatile uint16_t wanted[SERVOS];
static volatile uint16_t in_force[SERVOS];
static uint8_t active; /* the servo whose pulse is being made */
static bool high;
static uint16_t edge_time;

void servo_start(void) {
  HAL_PIN_LOW(SERVO_LEFT);
  HAL_PIN_LOW(SERVO_RIGHT);
  HAL_PIN_OUTPUT(SERVO_LEFT);
  HAL_PIN_OUTPUT(SERVO_RIGHT);
  HAL_PIN_PULL_UP(TURRET);
  servo_set(0, 0);
  servo_turn(0);
  servo_frame();
}

void servo_connect_turret(bool connected) {
  if (connected) {
    HAL_PIN_OUTPUT_LOW(TURRET);
  } else {
    HAL_PIN_PULL_UP(TURRET);
  }
}

void servo_set(uint16_t left, uint16_t right) {
  HAL_ATOMIC {
    wanted[LEFT] = left;
    wanted[RIGHT] = right;
  }
}

void servo_turn(uint16_t turret) {
  HAL_ATOMIC { wanted[SERVO_TURRET] = turret; }
}

uint16_t servo_pulse(uint8_t servo) {
  uint16_t width = 0;
  HAL_ATOMIC { width = in_force[servo]; }
  return width;
}

void servo_frame(void) {
  in_force[LEFT] = wanted[LEFT];
  in_force[RIGHT] = wanted[RIGHT];
  in_force[SERVO_TURRET] = wanted[SERVO_TURRET];
}

void servo_begin(uint8_t servo, uint16_t start) {
  if (in_force[servo] == 0) {
    return;
  }
  active = servo;
  high = false;
  edge_time = (uint16_t)(start + RISE_OFFSET);
  hal_edge_arm(edge_time);
}

void servo_on_edge(void) {
  const uint16_t late = hal_edge_wait(edge_time);
  if (active == LEFT) { /* the same way for both edges of a servo, so that the width is exact */
    HAL_PIN_TOGGLE(SERVO_LEFT);
  } else if (active == RIGHT) {
    HAL_PIN_TOGGLE(SERVO_RIGHT);
  } else {
    HAL_PIN_TOGGLE(TURRET);
  }
  if (high) {
    hal_edge_disarm();
    return;
  }
  high = true;
  edge_time = (uint16_t)(edge_time + late + in_force[active]); /* a late pulse keeps its width */
  hal_edge_arm(edge_time);
}

void servo_report_telemetry(msg_telemetry *message) {
  message->pulse_left = servo_pulse(LEFT);
  message->pulse_right = servo_pulse(RIGHT);
}
