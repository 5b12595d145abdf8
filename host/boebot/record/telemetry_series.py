"""A board's telemetry as arrays: computed after a run from the bytes that were put aside."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from boebot.devices.device import Column, Held, Readout
from boebot.devices.encoder import WheelEncoder
from boebot.devices.servo import ContinuousServo
from boebot.link.messages import Telemetry
from boebot.odometry import WheelDirection, dead_reckoning
from boebot.record.record import Record
from boebot.record.series import Bools, Floats, Pose, Series

if TYPE_CHECKING:
    from boebot.description.robots import RobotDescription

_APART = 1 << 40  # ticks between two starts of the board, as positions have them
_NUMPY_CODES = {"b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4"}
TELEMETRY_DTYPE = np.dtype(
    [
        (name, _NUMPY_CODES[code])
        for name, code in zip(Telemetry._fields, re.findall("[bBhHiI]", Telemetry.STRUCT.format), strict=True)
    ]
)
_ROW = np.dtype([*TELEMETRY_DTYPE.descr, ("host", "<f8"), ("bound", "<f8")])  # of the record: with its stamp


class Directions:
    """In which direction each wheel is thought to turn, where its encoder does not say it."""

    def __init__(self) -> None:
        self.encoder_left = WheelDirection()
        self.encoder_right = WheelDirection()


class TelemetrySeries(Series):
    """A board's telemetry, one entry per control tick received."""

    def __init__(
        self, record: Record, robot: RobotDescription, tick_s: float, directions: Directions | None = None
    ) -> None:
        """`directions`: of the wheels before, where these ticks are not a run's first; they go on with it."""
        super().__init__(record, robot, tick_s, None)
        self._directions = directions or Directions()
        self.raw: NDArray[np.void] = record.table("telemetry", _ROW)
        self.status = self.raw["status"]

    @cached_property
    def signals(self) -> tuple[Floats, Floats]:
        """See `Series`: what the pulses in force stand for; 0 without pulses."""
        return self._signal("servo_left"), self._signal("servo_right")

    @cached_property
    def wheel_travel(self) -> tuple[Floats, Floats]:
        """What left and right wheel rolled from tick to tick (m, forward positive); the first entry is 0."""
        left, right = self.signals
        return self._travel("encoder_left", left), self._travel("encoder_right", right)

    def held(self, kind: Any) -> Held:
        """See `boebot.devices.device.Run`."""
        if kind not in self._held:
            rows = self._record.messages(kind)
            found = [message for _, message in rows]
            newest, ticks = newest_messages([row for row, _ in rows], found, self.raw["tick"], self._restarted)
            self._held[kind] = Held(found, newest, ticks * self._tick_s)
        return self._held[kind]

    @cached_property
    def _held(self) -> dict[type, Held]:
        return {}

    def values(self, device: str) -> Floats:
        """A robot with a board has none."""
        raise NotImplementedError(device)

    ages = values

    def own_columns(self) -> list[Column]:
        """See `Series`."""
        raw = self.raw
        return [
            Column("status", "", raw["status"], None),
            Column("setpoint_sequence", "", raw["setpoint_sequence"], None),
            Column("latch", "", raw["latch"], None),
            Column("supply", "v", raw["supply"] / 1000, 3),
            Column("overruns", "", raw["overruns"], None),
        ]

    def readouts(self) -> list[Readout]:
        """See `Series`: the devices, and the board's supply."""
        supply = np.where(self.raw["supply"] > 0, self.raw["supply"] / 1000, np.nan)
        return [*super().readouts(), Readout("supply", "V", 2, supply, np.zeros(len(self)))]

    def odometry(self) -> Pose:
        """See `Series`: by the encoders; without them it stays there."""
        return Pose(*dead_reckoning(*self.wheel_travel, self._robot.body.track_width_m))

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

    def _signal(self, name: str) -> Floats:
        servo, pulse_us = self._robot.device.get(name), self.number(name, "pulse")
        if not isinstance(servo, ContinuousServo) or servo.gain_us == 0:
            return np.zeros(len(self))
        return np.where(pulse_us > 0, (pulse_us - servo.centre_us) / servo.gain_us, 0.0)

    def _travel(self, name: str, signal: Floats) -> Floats:
        encoder = self._robot.device.get(name)
        if not len(self) or not isinstance(encoder, WheelEncoder):
            return np.zeros(len(self))
        counts = self.raw[name]  # 32 bits, and so are their differences: counts roll over
        edges = np.diff(counts, prepend=counts[0]).astype(np.int32).astype(np.int64)
        edges[self._restarted] = 0  # counts began afresh
        if encoder.LINES == 1:
            steps = np.diff(self.time, prepend=self.time[0])
            edges *= getattr(self._directions, name).update_all(signal, steps)
        return np.asarray(edges * encoder.metres_per_edge(self._robot.body.wheel_radius_m), dtype=np.float64)


def newest_messages(
    rows: Sequence[int], messages: Sequence[Any], ticks: NDArray[np.uint32], restarted: Bools
) -> tuple[NDArray[np.intp], Floats]:
    """For each tick of telemetry the message that was the newest then (-1: none), and the ticks since (NaN: none).

    `rows`: the tick at which each message had come. Both are laid along one line of ticks that goes on over roll-overs
    of the board's count and its restarts.
    """
    if not len(messages) or not len(ticks):
        return np.full(len(ticks), -1, dtype=np.intp), np.full(len(ticks), np.nan)
    steps = np.diff(ticks, prepend=ticks[:1]).astype(np.int32).astype(np.int64)
    steps[restarted] = _APART
    at = np.cumsum(steps)
    near = np.asarray(rows, dtype=np.intp)
    messages_at = at[near] + (np.array([message.tick for message in messages], dtype=np.uint32) - ticks[near]).astype(
        np.int32
    )
    order = np.argsort(messages_at, kind="stable")
    place = np.searchsorted(messages_at[order], at, side="right") - 1
    newest = np.where(place >= 0, order[place], -1)
    since = np.where(newest >= 0, at - messages_at[newest], _APART)
    none = since >= _APART // 2  # of an earlier start
    newest[none] = -1
    return newest, np.where(none, np.nan, since.astype(np.float64))
