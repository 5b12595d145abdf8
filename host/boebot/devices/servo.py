"""Continuous-rotation servos, which drive the wheels: the pulse sets the speed.

pulse = centre + gain · signal,   signal = (pulse - centre) / gain

What a brain reads is the pulse that the firmware sends now. Pins 8 to 13 can do it.

    [device.servo_left]
    type = "continuous_servo"
    pin = 13
    centre_us = 1500.0
    gain_us = 200.0

    robot.servo_left.signal
"""

from __future__ import annotations

from typing import Annotated, ClassVar, NamedTuple

import msgspec

from boebot.devices.device import AnyServo, Column, FaultKind, Place, Reader, Run
from boebot.devices.faults import MOTOR_FAULTS
from boebot.link.messages import Telemetry

PULSE_SCALE_US = 0.0625  # microseconds per count of the pulse widths on the wire


class Servo(NamedTuple):
    """One wheel's servo, as driven now."""

    pulse_us: float | None
    """Pulse width in force, or None: no pulses, the wheel turns freely."""
    signal: float
    """The motor signal -1..1 that this pulse stands for; 0 without pulses."""
    age: float
    """Seconds since this was so."""
    valid: bool
    """Whether the value may be trusted."""


class ContinuousServo(AnyServo, tag="continuous_servo", frozen=True, kw_only=True):
    """A servo modified for continuous rotation: the pulse sets the wheel's speed."""

    centre_us: Annotated[float, msgspec.Meta(ge=1400, le=1600)]
    gain_us: Annotated[float, msgspec.Meta(ge=-200, le=200)]  # pulse offset at full forward signal

    READING: ClassVar = Servo
    GROUP: ClassVar[str] = "servos"
    NAMES: ClassVar[tuple[str, ...]] = ("servo_left", "servo_right")
    SHOWN: ClassVar = ("pulse", "µs", 1.0, 0)
    DOES: ClassVar[str] = "drives"
    FAULTS: ClassVar = {
        **MOTOR_FAULTS,
        "offset": FaultKind("pulses count as longer by this", "us", 30.0, least=-500.0, most=500.0, harmless=0.0),
    }

    def reader(self, place: Place) -> Reader:
        """See `Device`."""
        field = Telemetry._fields.index(_pulse_field(place))
        centre_us, gain_us = self.centre_us, self.gain_us

        def read(sample: Telemetry, _: object) -> Servo:
            counts = sample[field]
            if counts == 0:
                return Servo(None, 0.0, 0.0, True)
            pulse_us = counts * PULSE_SCALE_US
            return Servo(pulse_us, (pulse_us - centre_us) / gain_us if gain_us else 0.0, 0.0, True)

        return read

    def columns(self, place: Place, run: Run) -> list[Column]:
        """The pulse; 0: none."""
        return [Column("pulse", "us", run.raw[_pulse_field(place)] * PULSE_SCALE_US, 4)]


def _pulse_field(place: Place) -> str:
    return place.name.replace("servo_", "pulse_")
