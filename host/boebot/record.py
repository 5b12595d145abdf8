"""The record of a run: what crossed the wire, every telemetry message, every command; and the table made of
it.

While a run goes on, only bytes are put aside. Everything else is computed afterwards, from those bytes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from boebot import robots
from boebot.devices.encoder import EDGE_PERIOD_SCALE, EncoderReader
from boebot.devices.infrared import NEVER
from boebot.devices.ping import PingReader
from boebot.devices.servo import PULSE_SCALE_US
from boebot.link.delivery import BoardEvent
from boebot.link.messages import Infrared, Status, Telemetry, Whiskers
from boebot.odometry import Odometry, WheelDirection

if TYPE_CHECKING:
    from boebot.boards import Truth

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_NUMPY_CODES = {"b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4"}
TELEMETRY_DTYPE = np.dtype(
    [
        (name, _NUMPY_CODES[code])
        for name, code in zip(Telemetry._fields, re.findall("[bBhHiI]", Telemetry.STRUCT.format), strict=True)
    ]
)


@dataclass
class Record:
    """What is put aside while a run goes on.

    Attributes:
        telemetry: payloads, oldest first.
        times: the run's time (s) of each, by the board's clock.
        stamps: (host time of the tick in s, its error bound in s) of each.
        events: what the board told exactly once, oldest first.
        steps: (index into telemetry of the observation, command kind, left, right), one per step of the
        brain.
    """

    telemetry: list[bytes] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    stamps: list[tuple[float, float]] = field(default_factory=list)
    events: list[BoardEvent] = field(default_factory=list)
    steps: list[tuple[int, str, float, float]] = field(default_factory=list)


@dataclass(frozen=True)
class Pose:
    """Poses over time: arrays of equal length."""

    x: Floats
    """m"""
    y: Floats
    """m"""
    heading: Floats
    """rad, counter-clockwise from the x axis"""


class Series:
    """A run's telemetry as arrays in SI units, one entry per control tick received. Computed when first asked for."""

    def __init__(self, record: Record, robot: robots.RobotDescription, tick_s: float) -> None:
        self._robot = robot
        self._tick_s = tick_s
        self._steps = record.steps
        self.raw: NDArray[np.void] = np.frombuffer(b"".join(record.telemetry), dtype=TELEMETRY_DTYPE)
        self.time: Floats = np.array(record.times, dtype=np.float64)

    def __len__(self) -> int:
        return len(self.raw)

    @cached_property
    def left_whisker(self) -> Bools:
        """Pressed."""
        return self._flag("whiskers", int(Whiskers.LEFT))

    @cached_property
    def right_whisker(self) -> Bools:
        """Pressed."""
        return self._flag("whiskers", int(Whiskers.RIGHT))

    @cached_property
    def left_ir(self) -> Bools:
        """Something detected at the last flash."""
        return self._flag("infrared", int(Infrared.LEFT))

    @cached_property
    def right_ir(self) -> Bools:
        """Something detected at the last flash."""
        return self._flag("infrared", int(Infrared.RIGHT))

    @cached_property
    def infrared_age(self) -> Floats:
        """Seconds; NaN if never measured."""
        return self._age("infrared_age")

    @cached_property
    def ping_age(self) -> Floats:
        """Seconds; NaN if never measured."""
        return self._age("ping_age")

    @cached_property
    def ping_distance(self) -> Floats:
        """Metres; NaN without an echo."""
        sonar = self._robot.device.get("ping")
        if not isinstance(sonar, robots.Ping):
            return np.full(len(self), np.nan)
        reader = PingReader(sonar.range_min_m, sonar.range_max_m, sonar.period_ticks, self._tick_s)
        return reader.distances(self.raw["ping_echo"], self.raw["ping_age"])

    @cached_property
    def left_pulse_us(self) -> Floats:
        """Servo pulse in force; 0: none."""
        return np.asarray(self.raw["pulse_left"] * PULSE_SCALE_US, dtype=np.float64)

    @cached_property
    def right_pulse_us(self) -> Floats:
        """Servo pulse in force; 0: none."""
        return np.asarray(self.raw["pulse_right"] * PULSE_SCALE_US, dtype=np.float64)

    @cached_property
    def left_signal(self) -> Floats:
        """Motor signal that the pulse in force stands for; 0 without pulses."""
        return self._signal("servo_left", self.left_pulse_us)

    @cached_property
    def right_signal(self) -> Floats:
        """Motor signal that the pulse in force stands for; 0 without pulses."""
        return self._signal("servo_right", self.right_pulse_us)

    @cached_property
    def left_edge_period(self) -> Floats:
        """Seconds between the last two edges; 0: none within 0.5 s."""
        return np.asarray(self.raw["edge_period_left"] * EDGE_PERIOD_SCALE, dtype=np.float64)

    @cached_property
    def right_edge_period(self) -> Floats:
        """Seconds between the last two edges; 0: none within 0.5 s."""
        return np.asarray(self.raw["edge_period_right"] * EDGE_PERIOD_SCALE, dtype=np.float64)

    @cached_property
    def commands(self) -> list[tuple[str, float, float]]:
        """The command in force at each tick, as the brain gave it."""
        commands: list[tuple[str, float, float]] = []
        current = ("stop", 0.0, 0.0)
        for index, kind, left, right in self._steps:
            commands += [current] * (index - len(commands))
            current = (kind, left, right)
        return commands + [current] * (len(self) - len(commands))

    @cached_property
    def wheel_travel(self) -> tuple[Floats, Floats]:
        """What left and right wheel rolled from tick to tick (m, forward positive); the first entry is 0."""
        return self._travel("left", self.left_signal), self._travel("right", self.right_signal)

    def odometry(self, start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Pose:
        """The pose estimate at each tick, from `start` (x m, y m, heading rad) at the first."""
        left, right = self.wheel_travel
        estimate = Odometry(self._robot.body.track_width_m, *start)
        poses = np.empty((3, len(self)))
        for index in range(len(self)):
            if left[index] or right[index]:
                estimate.update(float(left[index]), float(right[index]))
            poses[0, index], poses[1, index], poses[2, index] = estimate.x, estimate.y, estimate.heading
        return Pose(*poses)

    def rising(self, flag: Status) -> int:
        """How many times the status flag went up."""
        return onsets((self.raw["status"] & int(flag)) != 0)

    @cached_property
    def overruns(self) -> int:
        """Control ticks overrun during the run; the board's counter has 8 bits and begins afresh with it."""
        counter = self.raw["overruns"]
        if not len(counter):
            return 0
        more = np.diff(counter, prepend=counter[0]).astype(np.uint8)
        more[self._restarted] = counter[self._restarted]
        return int(more.sum())

    @cached_property
    def _restarted(self) -> Bools:
        """Where the board was reset since the tick before; its count of ticks rolls over after 2^32."""
        ticks = self.raw["tick"]
        return np.asarray(np.diff(ticks, prepend=ticks[:1]).astype(np.int32) < 0, dtype=np.bool_)

    def _flag(self, name: str, bit: int) -> Bools:
        return np.asarray(self.raw[name] & bit, dtype=np.bool_)

    def _age(self, name: str) -> Floats:
        ticks = self.raw[name]
        return np.where(ticks < NEVER, ticks * self._tick_s, np.nan)

    def _signal(self, device: str, pulse_us: Floats) -> Floats:
        servo = self._robot.device.get(device)
        if not isinstance(servo, robots.ContinuousServo) or servo.gain_us == 0:
            return np.zeros(len(self))
        return np.where(pulse_us > 0, (pulse_us - servo.centre_us) / servo.gain_us, 0.0)

    def _travel(self, side: str, signal: Floats) -> Floats:
        device = self._robot.device.get(f"encoder_{side}")
        if not len(self) or not isinstance(device, robots.Encoder | robots.QuadratureEncoder):
            return np.zeros(len(self))
        counts = self.raw[f"encoder_{side}"]  # 32 bits, and so are their differences: counts roll over
        edges = np.diff(counts, prepend=counts[0]).astype(np.int32).astype(np.int64)
        edges[self._restarted] = 0  # counts began afresh
        metres_per_edge = EncoderReader(
            side == "left", device.edges_per_turn, self._robot.body.wheel_radius_m, directed=True
        ).metres_per_edge
        if isinstance(device, robots.Encoder):
            direction = WheelDirection()
            steps = np.diff(self.time, prepend=self.time[0])
            edges *= np.array(
                [direction.update(float(s), float(t)) for s, t in zip(signal, steps, strict=True)],
                dtype=np.int64,
            )
        return np.asarray(edges * metres_per_edge, dtype=np.float64)


def onsets(flags: Bools) -> int:
    """How many times a flag goes up; one that is up from the start counts."""
    return int(np.count_nonzero(flags[1:] & ~flags[:-1]) + (1 if len(flags) and flags[0] else 0))


def truth_at(truth: Truth, times: Floats) -> Pose:
    """The true pose at the given instants on the transport's clock, between samples by interpolation."""
    heading = np.interp(times, truth.time, np.unwrap(truth.heading))
    return Pose(
        np.interp(times, truth.time, truth.x),
        np.interp(times, truth.time, truth.y),
        np.arctan2(np.sin(heading), np.cos(heading)),
    )
