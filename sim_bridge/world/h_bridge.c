/* h_bridge.c: see h_bridge.h. */
#include "h_bridge.h"

/* What the current meets along its direction. */
typedef struct {
  double volts, ohm;
  double from_pack; /* 1: it comes from the pack, -1: it flows into it, 0: neither */
} way;

/* The way of a current forward (`flows` 1) or backward (-1). */
static way way_of(const h_bridge_parameters *p, int switches, double pack_v, double flows) {
  if (switches == (flows > 0.0 ? H_BRIDGE_FORWARD : H_BRIDGE_BACKWARD)) {
    return (way){pack_v - p->drop_v, p->drop_ohm, 1.0};
  }
  if (switches == H_BRIDGE_BRAKE) return (way){-(0.5 * p->drop_v + p->diode_v), 0.5 * p->drop_ohm + p->diode_ohm, 0.0};
  return (way){-(pack_v + 2.0 * p->diode_v), 2.0 * p->diode_ohm, -1.0};
}

void h_bridge_run(const h_bridge_parameters *self, const motor_dc_parameters *motor, h_bridge_flow *flow, int switches,
                  double pack_v, double speed, double dt) {
  const double emf = motor->emf_constant * motor->gear * speed; /* (1.2), (1.10) */
  double left = dt;
  for (int turn = 0; turn < 2 && left > 0.0; turn++) { /* it comes to 0 once at most */
    double flows = flow->current < 0.0 ? -1.0 : 1.0;
    way there = way_of(self, switches, pack_v, flows);
    if (flow->current == 0.0 && there.volts <= emf) {
      flows = -1.0;
      there = way_of(self, switches, pack_v, flows);
      if (there.volts <= -emf) return; /* no way is open */
    }
    const double ohm = motor->resistance_ohm + there.ohm;
    const double lag = motor->inductance_h / ohm;
    const double start = flows * flow->current;
    const double settled = (there.volts - flows * emf) / ohm; /* (1.1) with di/dt = 0 */
    double time = left, end = settled;
    if (settled < 0.0) { /* start + (settled - start) (1 - exp(-t / lag)) = 0 */
      time = lag * number_log(1.0 - start / settled);
      end = 0.0;
    }
    if (lag > 0.0 && !(time < left)) {
      time = left;
      end = settled + (start - settled) * number_exp(-time / lag);
    }
    const double charge = settled * time + (start - end) * lag; /* the integral of i, by (1.1) */
    flow->current = flows * end;
    flow->charge += flows * charge;
    flow->drawn += there.from_pack * charge;
    left -= time;
  }
}
