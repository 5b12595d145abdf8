/* h_bridge.h: one channel of an H-bridge (L298N) with a geared DC motor at its outputs, which turns a wheel.
 *
 * Enable high and the inputs different: it drives. Enable high and the inputs equal: brake. Enable low: coast (L298 data
 * sheet, "Input for ... bidirectional DC motor control"). An input that is not driven is low, a pulled-up one high: it takes
 * 30 uA. Enable without a pin is the module's jumper: high.
 *
 * Between two edges the current is solved exactly (world/h_bridge), at the speed of the wheel and the voltage of the pack
 * with which the world's step began. The torque of the next step is that of the mean current since the last: each PWM
 * pulse counts in full, whatever its frequency, a step late.
 * Faults, from the next edge or step on: dead, the motor's leads are off; reversed, they are swapped; weak, that share of its
 * torque.
 */
#ifndef PART_H_BRIDGE_H
#define PART_H_BRIDGE_H

#include "../world/h_bridge.h"
#include "part.h"

/* python: begin */
typedef struct {
  h_bridge_parameters bridge;
  motor_dc_parameters motor;
  double wheel_radius; /* m */
  double idle_a;       /* that the channel itself draws */
  int forward;         /* input that is high while it drives forward: 0 or 1 */
} h_bridge_part_parameters;

/* Turns a wheel. Shows the motor's mean current since it was last asked, A. Parameters: h_bridge_part_parameters. Pins:
 * both inputs, and enable or PART_NO_PIN. */
extern const part_kind h_bridge_kind;
/* python: end */

#endif
