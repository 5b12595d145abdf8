"""Brains and processes stepped without a board: a robot whose readings a test gives, step by step."""

from __future__ import annotations

from typing import Any

import msgspec
from hypothesis import strategies as st

from boebot.brain import Brain, MotorBehavior, Process
from boebot.description.robots import RobotDescription, load_robot
from boebot.devices.battery import Energy
from boebot.devices.latest import Latest, without_readings
from boebot.devices.light import Phototransistor
from boebot.devices.readings import Readings
from boebot.link import messages
from boebot.robot import Command, Equipment, Observation, Robot

SHIELDBOT = load_robot("shieldbot")
TICK_S = 0.01

BYTES, WORDS, COUNTS = st.integers(0, 255), st.integers(0, 65535), st.integers(-(2**31), 2**31 - 1)
ANYTHING = st.fixed_dictionaries(
    {
        "encoder_left": COUNTS,
        "encoder_right": COUNTS,
        "whiskers": st.integers(0, 3),
        "infrared": st.integers(0, 3),
        "infrared_age": BYTES,
        "ping_echo": WORDS,
        "ping_age": BYTES,
        "ping_status": st.sampled_from([int(one) for one in messages.PingStatus]),
        "pulse_left": WORDS,
        "pulse_right": WORDS,
        "battery": st.integers(0, 1023),
        "battery_age": BYTES,
        "light_left": WORDS,
        "light_right": WORDS,
        "light_age": BYTES,
        "compass_x": st.integers(-4096, 2047),
        "compass_y": st.integers(-4096, 2047),
        "compass_age": BYTES,
        "compass_status": st.sampled_from([int(one) for one in messages.CompassStatus]),
        "line_left": WORDS,
        "line_middle": WORDS,
        "line_right": WORDS,
        "line_age": BYTES,
    }
)
"""Any fields of telemetry."""
NOTHING = messages.Telemetry(*(0,) * len(messages.Telemetry._fields))
SLOW: list[Any] = [  # what slow devices say that have measured nothing
    without_readings(messages.DevicesTelemetry)._replace(supply=5000),
    without_readings(messages.LineTelemetry),
]
FULL = msgspec.structs.replace(  # every device of the shieldbot, and the line sensors, on
    SHIELDBOT,
    device={
        name: msgspec.structs.replace(device, on=True)
        for name, device in (load_robot("shieldbot-line").device | SHIELDBOT.device).items()
    },
)
QUAD = load_robot("shieldbot-quad")
_ARSIM = load_robot("arsim")
VEHICLE = msgspec.structs.replace(  # no board: analog infra-red, odometer, compass, lights, battery
    _ARSIM,
    device=_ARSIM.device
    | {
        "light_left": Phototransistor(position_m=(0.17, 0.1), heading_rad=0.5),
        "light_right": Phototransistor(position_m=(0.17, -0.1), heading_rad=-0.5),
        "battery": Energy(),
    },
)
LAYOUT = {
    "infrared_left": slice(0, 1),
    "infrared_right": slice(1, 2),
    "odometer": slice(2, 5),
    "compass": slice(5, 6),
    "light_left": slice(6, 7),
    "light_right": slice(7, 8),
    "battery": slice(8, 9),
}


class Stepped:
    """A robot, and the time that goes on by the brain's period with each step.

    Attributes:
        robot: what the brain meets.
        steps: how many there have been.
    """

    def __init__(self, period: float = 0.01, seed: int = 1, description: RobotDescription = SHIELDBOT) -> None:
        self.robot = Robot(description.name, period, seed)
        self.steps = 0
        self._equipment = Equipment(description, TICK_S)
        if description.has_board:
            self.see()

    def see(self, **fields: int) -> None:
        """What the sensors say from now on: fields of telemetry, and of the slow devices'."""
        slow = {}
        for message in SLOW:
            given = {
                name: fields.pop(name) for name in message._fields if name in fields and name not in NOTHING._fields
            }
            if given:
                slow[type(message)] = message._replace(tick=self.steps, **given)
        sample, latest = NOTHING._replace(tick=self.steps, **fields), Latest(slow, self.steps)
        self.robot.observation = Observation(sample, self._equipment, time=self.time, slow=latest)

    @property
    def time(self) -> float:
        """s, of the next step."""
        return self.steps * self.robot.period

    def step(self, brain: Brain, **fields: int) -> Command:
        """One step of the brain; its command."""
        self.see(**fields)
        brain.step(self.robot)
        self.steps += 1
        return self.robot.command


class SteppedVehicle(Stepped):
    """The same for a robot without a board: its readings, in the order of LAYOUT; those not given are 0."""

    def __init__(self, period: float = 0.01, seed: int = 1) -> None:
        super().__init__(period, seed, VEHICLE)
        self._equipment = Equipment(VEHICLE, TICK_S, LAYOUT)
        self.show()

    def show(self, *values: float) -> None:
        """What the sensors say from now on."""
        self.values = values + (0.0,) * (9 - len(values))
        sample = Readings(self.steps, 1, (0.0,) * 9, self.values)
        self.robot.observation = Observation(sample, self._equipment, time=self.time, slow=sample)

    def steer(self, brain: Brain, *values: float) -> Command:
        """One step of the brain with these readings; its command."""
        self.show(*values)
        brain.step(self.robot)
        self.steps += 1
        return self.robot.command


def alone(behavior: MotorBehavior, *others: Process) -> Brain:
    """A brain of one motor behavior, and cognitive processes."""
    return Brain([behavior, *others])
