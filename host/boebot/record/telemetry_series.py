"""A board's telemetry as arrays: computed after a run from the bytes that were put aside."""

from __future__ import annotations

import re
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from boebot.description import robots
from boebot.devices.encoder import EDGE_PERIOD_SCALE, EncoderReader
from boebot.devices.equipment import slow_readers
from boebot.devices.infrared import NEVER
from boebot.devices.ping import PingReader
from boebot.devices.servo import PULSE_SCALE_US
from boebot.link.messages import Infrared, Telemetry, Whiskers
from boebot.odometry import Odometry, WheelDirection
from boebot.record.devices_series import DevicesSeries
from boebot.record.record import Record
from boebot.record.series import Bools, Floats, Pose, Readout, Series

_NUMPY_CODES = {"b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4"}
TELEMETRY_DTYPE = np.dtype(
    [
        (name, _NUMPY_CODES[code])
        for name, code in zip(Telemetry._fields, re.findall("[bBhHiI]", Telemetry.STRUCT.format), strict=True)
    ]
)


class TelemetrySeries(Series):
    """A board's telemetry, one entry per control tick received."""

    def __init__(self, record: Record, robot: robots.RobotDescription, tick_s: float) -> None:
        super().__init__(record.times, record.steps)
        self._robot = robot
        self._slow_messages = record.devices
        self._tick_s = tick_s
        self.raw: NDArray[np.void] = np.frombuffer(b"".join(record.telemetry), dtype=TELEMETRY_DTYPE)
        self.status = self.raw["status"]

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
    def wheel_travel(self) -> tuple[Floats, Floats]:
        """What left and right wheel rolled from tick to tick (m, forward positive); the first entry is 0."""
        return self._travel("left", self.left_signal), self._travel("right", self.right_signal)

    @cached_property
    def devices(self) -> DevicesSeries:
        """What the slow devices said; nothing, if there are none."""
        readers = slow_readers(self._robot, self._tick_s)
        return DevicesSeries(self._slow_messages, self.raw["tick"], self._restarted, readers, self._tick_s)

    def columns(self) -> dict[str, tuple[NDArray[np.generic], int | None]]:
        """See `Series`."""
        raw = self.raw
        return {
            "encoder_left": (raw["encoder_left"], None),
            "encoder_right": (raw["encoder_right"], None),
            "edge_period_left_s": (self.left_edge_period, 6),
            "edge_period_right_s": (self.right_edge_period, 6),
            "whisker_left": (self.left_whisker, None),
            "whisker_right": (self.right_whisker, None),
            "infrared_left": (self.left_ir, None),
            "infrared_right": (self.right_ir, None),
            "infrared_age_s": (self.infrared_age, 3),
            "ping_distance_m": (self.ping_distance, 4),
            "ping_age_s": (self.ping_age, 3),
            "ping_status": (self.raw["ping_status"], None),
            "pulse_left_us": (self.left_pulse_us, 4),
            "pulse_right_us": (self.right_pulse_us, 4),
            "status": (raw["status"], None),
            "setpoint_sequence": (raw["setpoint_sequence"], None),
            "latch": (raw["latch"], None),
            "supply_v": (raw["supply"] / 1000, 3),
            "overruns": (raw["overruns"], None),
            **self.devices.columns(),
        }

    def readouts(self) -> list[Readout]:
        """See `Series`: the slow devices, and the board's supply."""
        supply = np.where(self.raw["supply"] > 0, self.raw["supply"] / 1000, np.nan)
        return [*self.devices.readouts(), Readout("supply", "V", 2, supply, np.zeros(len(self)))]

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
