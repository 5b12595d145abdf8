"""H-bridges (L298N) with the geared motors at their outputs: the drops of the bridge, and how motors differ."""

from __future__ import annotations

from boebot.devices.h_bridge import HBridge
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Part, joined

NO_PIN = 255
UNLIMITED = 1e9  # N m: the motor's current limits its torque


@joined(HBridge)
def part(device: HBridge, at: At) -> Part:
    """Bridge, motor and gear."""
    draw, unit = at.draw, 150 + at.side
    constant = device.motor_constant * (1.0 + draw["motor_spread"] * draw(unit, 0))
    friction = max(0.0, 1.0 + draw["motor_friction_spread"] * draw(unit, 1))
    drop = max(0.0, 1.0 + draw["bridge_spread"] * draw(unit, 2))
    bridge = [draw["bridge_drop_v"] * drop, draw["bridge_drop_ohm"], draw["bridge_diode_v"], draw["bridge_diode_ohm"]]
    motor = {
        "torque_constant": constant,
        "emf_constant": constant,
        "resistance_ohm": device.resistance_ohm,
        "inductance_h": device.inductance_h,
        "coulomb_n_m": device.motor_constant * device.no_load_a * friction,
        "gear": device.gear,
        "efficiency": device.efficiency,
        "torque_maximum_n_m": UNLIMITED,
    }
    values = [bridge, motor, at.body.wheel_radius_m, draw["bridge_idle_a"], device.forward == "in2"]
    enable = NO_PIN if device.enable_pin is None else device.enable_pin
    parameters = ffi.new("h_bridge_part_parameters *", values)
    return Part("h_bridge_kind", at.side, [device.in1_pin, device.in2_pin, enable], parameters)
