"""H-bridge (L298N module) and the geared DC motor at its outputs, which turns a wheel: one device for each channel, the
right wheel's with a name that ends in `right`.

Enable's PWM sets the speed, the two inputs the direction: different ones drive, equal ones brake, and without enable
the motor coasts. Without an `enable_pin` the module's jumper is in: always enabled. The motor is what its data sheet
says at `rated_v`; defaults are the yellow "TT" gear motor 1:48 at 6 V: 160 mA and 250 rpm without a load (measured by
Adafruit, #3777), 0.8 kg cm stalled (its sheet); stalled currents are said to be 0.6 to 1.5 A, and 0.8 A goes with that
torque and a gear of three plastic stages. For programs of one's own: the kit's firmware has none.

    [device.motor_left]
    type = "h_bridge"
    enable_pin = 5
    in1_pin = 7
    in2_pin = 8
    forward = "in1"                # the input that is high while the wheel drives forward: as the motor's leads are
"""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from boebot.devices.device import FIVE_VOLTS, GROUND, PACK, Device, NotNegative, Positive, Wire
from boebot.devices.faults import MOTOR_FAULTS


class HBridge(Device, tag="h_bridge", frozen=True, kw_only=True):
    """One channel of an L298N module with its motor."""

    in1_pin: int | str
    in2_pin: int | str
    enable_pin: int | str | None = None
    forward: Literal["in1", "in2"] = "in1"
    channel: Literal["A", "B"] = "A"  # on the module's print: ENA, IN1, IN2 or ENB, IN3, IN4
    rated_v: Positive = 6.0
    no_load_rpm: Positive = 250.0  # of the wheel
    no_load_a: NotNegative = 0.16  # what friction takes
    stall_a: Positive = 0.8
    stall_torque_n_m: Positive = 0.0785  # at the wheel
    gear: Positive = 48.0
    inductance_h: NotNegative = 0.002  # chosen: a 130-size motor

    PINS: ClassVar[dict[str, str]] = {"in1_pin": "in1", "in2_pin": "in2", "enable_pin": "enable"}
    HEARS: ClassVar[frozenset[str]] = frozenset(PINS)
    FAULTS: ClassVar = MOTOR_FAULTS
    COLUMNS: ClassVar = (("current", "a", 4),)
    SHOWN: ClassVar = ("current", "A", 1.0, 2)

    def fault(self) -> tuple[str, str] | None:
        """See `Device`."""
        if self.no_load_a >= self.stall_a:
            return "stall_a", f" is {self.stall_a:g}; expected more than no_load_a, {self.no_load_a:g} A"
        if self.efficiency > 1:
            most = self.stall_torque_n_m / self.efficiency
            said = f"expected at most {most:.3g} N m, that of a gear without losses"
            return "stall_torque_n_m", f" is {self.stall_torque_n_m:g}; {said}"
        return None

    @property
    def resistance_ohm(self) -> float:
        """Of the armature, R = V / I_stall."""
        return self.rated_v / self.stall_a

    @property
    def motor_constant(self) -> float:
        """c_e in V s/rad, and c_t in N m/A, which is the same number: (V - R I_0) / (G omega_0)."""
        axis_rad_s = self.gear * self.no_load_rpm * 2 * math.pi / 60
        return (self.rated_v - self.resistance_ohm * self.no_load_a) / axis_rad_s

    @property
    def efficiency(self) -> float:
        """Of the gear, from the stall torque G eta c_t (I_stall - I_0)."""
        return self.stall_torque_n_m / (self.gear * self.motor_constant * (self.stall_a - self.no_load_a))

    def wires(self) -> tuple[Wire, ...]:
        """See `Device`."""
        one, two = ("IN1", "IN2") if self.channel == "A" else ("IN3", "IN4")
        enable = f"EN{self.channel}"
        wired = Wire("enable_pin", enable) if self.enable_pin is not None else Wire(FIVE_VOLTS, enable, part="jumper")
        return wired, Wire("in1_pin", one), Wire("in2_pin", two), Wire(PACK, "12 V"), Wire(GROUND, "GND")

    @property
    def connector(self) -> str:
        """See `Device`."""
        return f"L298N module, channel {self.channel}"
