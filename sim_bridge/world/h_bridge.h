/* h_bridge.h: an H-bridge of bipolar transistors with free-wheel diodes (L298), from what it does to its motor's current.
 *
 * Four switches join the motor's two leads to the pack's plus or to ground. The current i flows on through the motor's
 * inductance whatever they do; what it meets on its way, along its direction, is
 *
 *   driven that way           u = pack - drop              two transistors; from the pack
 *   driven the other way      u = -(pack + 2 diode)        two diodes, since such transistors conduct one way only; into it
 *   brake: leads joined       u = -(drop / 2 + diode)      one transistor and one diode; the pack has no part in it
 *   coast: all switches open  u = -(pack + 2 diode)        two diodes; into the pack
 *
 * each drop being a voltage at little current and some ohms. Between two changes, L di/dt = u - R i - e with the back-EMF e
 * of a speed that holds still is solved exactly, by an exponential; where i comes to 0 it stays there, unless u > e drives it
 * the other way. So coasting ends the current within a pulse (discontinuous current), and below the drop of its way neither
 * drive nor brake has any effect: an L298 hardly brakes a slow wheel.
 */
#ifndef WORLD_H_BRIDGE_H
#define WORLD_H_BRIDGE_H

#include "motor_dc.h"

/* python: begin */
typedef struct {
  double drop_v, drop_ohm;   /* of two transistors in a row */
  double diode_v, diode_ohm; /* of one diode */
} h_bridge_parameters;

enum { H_BRIDGE_COAST, H_BRIDGE_BRAKE, H_BRIDGE_FORWARD, H_BRIDGE_BACKWARD };

typedef struct {
  double current; /* through the motor, A, positive forward */
  double charge;  /* that went through it since somebody set this to 0, A s */
  double drawn;   /* and from the pack, less what flowed back */
} h_bridge_flow;

/* `dt` seconds with the switches as they are, while the motor's shaft turns at `speed` rad/s. */
void h_bridge_run(const h_bridge_parameters *self, const motor_dc_parameters *motor, h_bridge_flow *flow, int switches,
                  double pack_v, double speed, double dt);
/* python: end */

#endif
