"""A run as columns: arrays in SI units, one entry per control tick that was recorded, of a robot with a board or
without one. Pages, pictures, tables and figures are made of them, while the run goes on and afterwards.

A `Reader` makes them of a record's rows as they come. Each time it gives the ticks that are new, and one tick before
them, which says how things were: so a long run is read piece by piece (`columns`), in as little memory as a short one,
and a live view reads on where it was.
"""

from __future__ import annotations

import bisect
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from boebot.description.equipment import places
from boebot.devices.device import Column, Held, Place, Readout
from boebot.devices.drawing import Sweeps
from boebot.devices.encoder import WheelEncoder
from boebot.devices.servo import ContinuousServo
from boebot.link.messages import DEVICE_MESSAGES, Telemetry
from boebot.odometry import WheelDirection, dead_reckoning
from boebot.record.blocks import EMPTY, Block, Group, joined
from boebot.record.record import COMMAND, KINDS, event_of, readings_row
from boebot.record.truth import Bools, Floats, Pose, Track, track_of
from boebot.showing import VALUES

if TYPE_CHECKING:
    from boebot.arenas import Arena
    from boebot.description.robots import RobotDescription
    from boebot.devices.readings import Layout
    from boebot.link.delivery import BoardEvent
    from boebot.record.record import Record

TICKS = 20_000  # of a piece
TRUTH_BEFORE_S = 0.5  # of the truth, before a piece's first tick
LATE_TICKS = 100  # after a piece's last one: a message of a slow device may come so much later than its reading
MESSAGES = {kind.NAME: kind for kind in DEVICE_MESSAGES}
Directions = tuple[WheelDirection, WheelDirection]
"""In which direction each wheel is thought to turn, where its encoder does not say it."""
_APART = 1 << 40  # ticks between two starts of the board, as positions have them
_NUMPY_CODES = {"b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4"}
_TELEMETRY = np.dtype(
    [
        (name, _NUMPY_CODES[code])
        for name, code in zip(Telemetry._fields, re.findall("[bBhHiI]", Telemetry.STRUCT.format), strict=True)
    ]
    + [("host", "<f8"), ("bound", "<f8")]  # the stamp
)


class Recorded(Protocol):
    """A run, as far as columns are made of it; see `boebot.record.run.Run`."""

    robot: RobotDescription
    layout: Layout | None
    tick: float
    record: Record
    clock_offset: float
    world: Arena | None


@dataclass(eq=False, repr=False, kw_only=True)
class Columns(ABC):
    """Consecutive ticks of a robot, or some of them.

    Attributes:
        robot, tick_s, layout: as of `Run`.
        first: index of the first tick that is new: 0 or 1.
        time: the run's time (s), by the robot's clock.
        raw: what was recorded at each tick: a board's telemetry, or a vehicle's readings; has the columns "tick" and
            "status" (flags, `boebot.link.messages.Status`).
        steps: at which of the ticks the brain has stepped: their indices.
        command: in force at each tick: kind (index of KINDS), left, right, as the brain gave it.
        slow: what a board's other messages said, by their kind.
        showing: rows of what the brain showed meanwhile (boebot.record.brain_record), with what it had shown before.
        travel: what left and right wheel rolled from tick to tick (m, forward positive); the first entry is 0.
        odometry: at each tick, as seen from the run's start: there it is 0, 0, 0; None: the robot has neither encoders
            nor an odometer.
        track: rows of the truth meanwhile. true_pose, contact: the true pose at each tick, and whether the body had
            touched something. None: nobody knows.
    """

    robot: RobotDescription
    tick_s: float
    layout: Layout | None
    first: int
    time: Floats
    raw: NDArray[np.void]
    steps: NDArray[np.intp]
    command: NDArray[np.void]
    slow: dict[Any, Held] = field(default_factory=dict)
    showing: Block = EMPTY
    travel: tuple[Floats, Floats] | None = None
    odometry: Pose | None = None
    track: Track | None = None
    true_pose: Pose | None = None
    contact: Bools | None = None

    def __len__(self) -> int:
        return len(self.time)

    def part(self, which: NDArray[np.intp]) -> Columns:
        """The ticks of these indices, without what the brain showed and rows of the truth."""
        return replace(
            self,
            first=0,
            time=self.time[which],
            raw=self.raw[which],
            steps=np.flatnonzero(np.isin(which, self.steps)),
            command=self.command[which],
            slow={kind: _held_of(held, which) for kind, held in self.slow.items()},
            travel=None,
            odometry=None if self.odometry is None else self.odometry.part(which),
            true_pose=None if self.true_pose is None else self.true_pose.part(which),
            contact=None if self.contact is None else self.contact[which],
            showing=EMPTY,
            track=None,
        )

    @property
    def status(self) -> NDArray[np.uint16]:
        """Flags at each tick."""
        status: NDArray[np.uint16] = self.raw["status"]
        return status

    @property
    @abstractmethod
    def signals(self) -> tuple[Floats, Floats]:
        """Motor signals in force, left and right."""

    @property
    def placed_odometry(self) -> Pose | None:
        """The odometry as it lies in the arena, from the true pose at the start; None: there is no truth, or no
        odometry."""
        if self.true_pose is None or self.odometry is None:
            return None
        return self.odometry.placed(*self.true_pose.at(0))

    @property
    def overruns(self) -> int:
        """Control ticks overrun since the first one."""
        return 0

    @abstractmethod
    def own_columns(self) -> list[Column]:
        """Columns of run.csv besides those of the devices."""

    @abstractmethod
    def locate(self, directions: Directions, place: tuple[float, float, float] | None) -> None:
        """Computes `odometry`. `directions`: of the left and the right wheel so far; they go on with it. `place`: that
        of the first tick; None: it is the run's first."""

    @cached_property
    def _places(self) -> dict[str, Place]:
        return places(self.robot, self.tick_s, self.layout)

    @cached_property
    def _device_columns(self) -> dict[str, dict[str, Column]]:
        return {}

    def device_columns(self, device: str) -> Mapping[str, Column]:
        """The columns of one device, by their names; none: the robot does not have it."""
        if device not in self._places:
            return {}
        if device not in self._device_columns:
            found = self.robot.device[device].columns(self._places[device], self)
            self._device_columns[device] = {column.name: column for column in found}
        return self._device_columns[device]

    def flag(self, device: str, name: str) -> Bools:
        """A column of yes and no, such as a whisker's "pressed"; no, if the robot does not have the device."""
        column = self.device_columns(device).get(name)
        return np.zeros(len(self), dtype=np.bool_) if column is None else np.asarray(column.values, dtype=np.bool_)

    def number(self, device: str, name: str) -> Floats:
        """A column of numbers, such as the Ping's "distance"; NaN, if the robot does not have the device."""
        column = self.device_columns(device).get(name)
        return np.full(len(self), np.nan) if column is None else np.asarray(column.values, dtype=np.float64)

    def columns(self) -> dict[str, tuple[NDArray[Any], int | None]]:
        """The devices' columns for run.csv: heading (unit in its name) -> (values, digits; None: whole numbers)."""
        every = [(device, column) for device in self._places for column in self.device_columns(device).values()]
        every += [("", column) for column in self.own_columns()]
        return {
            "_".join(filter(None, (device, column.name, column.unit))): (column.values, column.digits)
            for device, column in every
        }

    def readouts(self) -> list[Readout]:
        """The devices' readings that pages show as a number."""
        found = [
            self.robot.device[device].readout(place, self, self.device_columns(device))
            for device, place in self._places.items()
        ]
        return [readout for readout in found if readout is not None]

    def signs(self) -> list[tuple[str, str, Bools]]:
        """Devices that are on or off, as pages show them: name, colour, and whether on at each tick."""
        signs = [(device, self.robot.device[device].sign()) for device in self._places]
        return [(device, sign[1], self.flag(device, sign[0])) for device, sign in signs if sign is not None]

    def sweeps(self) -> list[Sweeps]:
        """The areas that devices measured, which pictures and pages show."""
        found = [self.robot.device[device].sweeps(place, self) for device, place in self._places.items()]
        return [sweeps for sweeps in found if sweeps is not None]

    def values(self, device: str) -> Floats:
        """All readings of a device of a robot without a board, shape (ticks, readings of the device)."""
        assert self.layout is not None
        return np.asarray(self.raw["values"][:, self.layout[device]], dtype=np.float64)

    def ages(self, device: str) -> Floats:
        """Their ages (s)."""
        if self.layout is None:  # what is in telemetry is of its tick
            return np.zeros(len(self))
        return np.asarray(self.raw["ages"][:, self.layout[device].start], dtype=np.float64)

    def held(self, kind: type) -> Held:
        """See `boebot.devices.device.Run`."""
        return self.slow.get(kind) or Held([], np.full(len(self), -1, dtype=np.intp), np.full(len(self), np.nan))


def chained(parts: Sequence[Columns]) -> Columns:
    """These ticks as one, without their first values and rows of the truth."""
    if len(parts) == 1:
        return parts[0]
    begins = np.cumsum([0, *map(len, parts[:-1])])
    contact = [part.contact for part in parts if part.contact is not None]
    return replace(
        parts[0],
        time=np.concatenate([part.time for part in parts]),
        raw=np.concatenate([part.raw for part in parts]),
        command=np.concatenate([part.command for part in parts]),
        steps=np.concatenate([begin + part.steps for begin, part in zip(begins, parts, strict=True)]),
        slow={
            kind: _held_all([part.held(kind) for part in parts]) for kind in {k for part in parts for k in part.slow}
        },
        odometry=Pose.chained([part.odometry for part in parts]),
        true_pose=Pose.chained([part.true_pose for part in parts]),
        contact=np.concatenate(contact) if len(contact) == len(parts) else None,
    )


def _held_of(held: Held, which: NDArray[np.intp]) -> Held:
    """At some ticks, with the messages that are needed there."""
    newest = held.newest[which]
    used = np.unique(newest[newest >= 0])
    place = np.where(newest >= 0, np.searchsorted(used, newest), -1)
    return Held([held.messages[index] for index in used.tolist()], place, held.since_s[which])


def _held_all(every: Sequence[Held]) -> Held:
    begins = np.cumsum([0, *(len(held.messages) for held in every[:-1])])
    newest = [np.where(held.newest >= 0, begin + held.newest, -1) for begin, held in zip(begins, every, strict=True)]
    messages = [message for held in every for message in held.messages]
    return Held(messages, np.concatenate(newest), np.concatenate([held.since_s for held in every]))


# ---- a robot with a board, and one without ---------------------------------------------------------------------------


class BoardColumns(Columns):
    """Of a robot with a board: its telemetry."""

    @cached_property
    def signals(self) -> tuple[Floats, Floats]:
        """See `Columns`: what the pulses in force stand for; 0 without pulses."""
        return self._signal("servo_left"), self._signal("servo_right")

    def telemetry(self, index: int) -> Telemetry:
        """The message of that tick."""
        return Telemetry(*self.raw[index].item()[:-2])

    def own_columns(self) -> list[Column]:
        """See `Columns`."""
        raw = self.raw
        return [
            Column("status", "", raw["status"], None),
            Column("setpoint_sequence", "", raw["setpoint_sequence"], None),
            Column("latch", "", raw["latch"], None),
            Column("supply", "v", raw["supply"] / 1000, 3),
            Column("overruns", "", raw["overruns"], None),
        ]

    def readouts(self) -> list[Readout]:
        """See `Columns`: the devices, and the board's supply."""
        supply = np.where(self.raw["supply"] > 0, self.raw["supply"] / 1000, np.nan)
        return [*super().readouts(), Readout("supply", "V", 2, supply, np.zeros(len(self)))]

    def locate(self, directions: Directions, place: tuple[float, float, float] | None) -> None:
        """See `Columns`: by the encoders."""
        left, right = self.signals
        self.travel = (
            self._travel("encoder_left", left, directions[0]),
            self._travel("encoder_right", right, directions[1]),
        )
        if self.robot.has("encoder_left") and self.robot.has("encoder_right"):
            pose = Pose(*dead_reckoning(*self.travel, self.robot.body.track_width_m))
            self.odometry = pose if place is None else pose.placed(*place)

    @cached_property
    def overruns(self) -> int:
        """Control ticks overrun since the first one; the board's counter has 8 bits and begins afresh with it."""
        counter = self.raw["overruns"]
        if not len(counter):
            return 0
        more = np.diff(counter, prepend=counter[0]).astype(np.uint8)
        restarted = restarts(self.raw["tick"])
        more[restarted] = counter[restarted]
        return int(more.sum())

    def _signal(self, name: str) -> Floats:
        servo, pulse_us = self.robot.device.get(name), self.number(name, "pulse")
        if not isinstance(servo, ContinuousServo) or servo.gain_us == 0:
            return np.zeros(len(self))
        return np.where(pulse_us > 0, (pulse_us - servo.centre_us) / servo.gain_us, 0.0)

    def _travel(self, name: str, signal: Floats, direction: WheelDirection) -> Floats:
        encoder = self.robot.device.get(name)
        if not len(self) or not isinstance(encoder, WheelEncoder):
            return np.zeros(len(self))
        counts = self.raw[name]  # 32 bits, and so are their differences: counts roll over
        edges = np.diff(counts, prepend=counts[0]).astype(np.int32).astype(np.int64)
        edges[restarts(self.raw["tick"])] = 0  # counts began afresh
        if encoder.LINES == 1:
            edges *= direction.update_all(signal, np.diff(self.time, prepend=self.time[0]))
        return np.asarray(edges * encoder.metres_per_edge(self.robot.body.wheel_radius_m), dtype=np.float64)


class VehicleColumns(Columns):
    """Of a robot without a board: its readings."""

    @property
    def signals(self) -> tuple[Floats, Floats]:
        """See `Columns`."""
        return self.raw["left"], self.raw["right"]

    def own_columns(self) -> list[Column]:
        """See `Columns`."""
        left, right = self.signals
        return [
            Column("signal_left", "", left, 4),
            Column("signal_right", "", right, 4),
            Column("status", "", self.status, None),
        ]

    def locate(self, directions: Directions, place: tuple[float, float, float] | None) -> None:
        """See `Columns`: the odometer's own estimate."""
        if not self.robot.has("odometer"):
            return
        x, y, heading = self.values("odometer").T
        pose = Pose(x - x[:1], y - y[:1], heading).placed(0.0, 0.0, -float(heading[0]) if len(self) else 0.0)
        self.odometry = pose if place is None else pose.placed(*place)


class ProgramColumns(VehicleColumns):
    """Of a robot that a program of the user's drives: what it reads, and what its motors get, it does not say."""

    @property
    def signals(self) -> tuple[Floats, Floats]:
        """See `Columns`: not known."""
        unknown = np.full(len(self), np.nan)
        return unknown, unknown

    def own_columns(self) -> list[Column]:
        """See `Columns`: none."""
        return []


def restarts(ticks: NDArray[np.uint32]) -> Bools:
    """Where a board was reset since the tick before; its count of ticks rolls over after 2^32."""
    return np.asarray(np.diff(ticks, prepend=ticks[:1]).astype(np.int32) < 0, dtype=np.bool_)


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


# ---- from rows to columns --------------------------------------------------------------------------------------------


class Reader:
    """Makes columns of a robot's rows, and goes on where it was.

    Attributes:
        offset_s: the transport's clock at the run's time 0 (s).
    """

    def __init__(self, result: Recorded) -> None:
        """`result`: what is known of the robot; of its record nothing is read."""
        self.offset_s = result.clock_offset
        self._robot, self._tick_s, self._layout = result.robot, result.tick, result.layout
        self._knows_truth = result.world is not None
        self._ticks = "telemetry" if result.layout is None else "readings"
        self._rows: dict[str, Block] = {}  # from the last tick that was read on
        self._first = 0
        self._directions = WheelDirection(), WheelDirection()
        self._place: tuple[float, float, float] | None = None  # by odometry, at that tick

    def feed(self, group: Group) -> None:
        """The next rows of the record; streams that no columns are made of may be among them."""
        for name in (self._ticks, "command", VALUES, *MESSAGES, *(["truth"] if self._knows_truth else ())):
            if name in group:
                self._rows[name] = joined(self._rows.get(name), group[name])

    @property
    def ticks(self) -> int:
        """How many wait to be read."""
        return len(self._rows.get(self._ticks, EMPTY)) - self._first

    @property
    def truth(self) -> Block:
        """The rows of it that wait, with those of the last tick."""
        return self._rows.get("truth", EMPTY)

    def read(self, most: int | None = None) -> Columns:
        """Those ticks, one before them, and what happened meanwhile. `most`: only the oldest ones, where more than
        `LATE_TICKS` follow them; None: all."""
        rows, first = self._rows, self._first
        times = rows.get(self._ticks, EMPTY).times
        if most is not None:
            last = first + most - 1
            rows, self._rows = _cut(rows, float(times[last]), float(times[last + LATE_TICKS]), self.offset_s)
        elif len(times):
            _, self._rows = _cut(rows, float(times[-1]), float(times[-1]), self.offset_s)
        columns = self._columns(rows, first)
        columns.locate(self._directions, self._place)
        if len(times):
            self._first = 1
            self._place = None if columns.odometry is None else columns.odometry.at(-1)
        return columns

    def _columns(self, rows: Group, first: int) -> Columns:
        ticks, commands = rows.get(self._ticks, EMPTY), rows.get("command", EMPTY)
        time, said = ticks.times, commands.table(COMMAND)
        if said["kind"].max(initial=0) >= len(KINDS):
            raise ValueError("a command of an unknown kind")
        steps = np.searchsorted(time, commands.times, side="right") - 1
        said = np.concatenate((np.zeros(1, dtype=COMMAND), said))  # before the first one: stop
        robot: Any = {"robot": self._robot, "tick_s": self._tick_s, "layout": self._layout, "first": first}
        robot |= {"time": time, "steps": steps, "showing": rows.get(VALUES, EMPTY)}
        robot["command"] = said[np.searchsorted(steps, np.arange(len(time)), side="right")]
        track = track_of(rows.get("truth", EMPTY))
        if len(track.time) and len(time):
            at = time + self.offset_s
            robot |= {"track": track, "true_pose": track.at(at), "contact": track.contact_at(at)}
        if self._layout is not None:
            row = readings_row(max((where.stop for where in self._layout.values()), default=0))
            kind = ProgramColumns if self._robot.has_board else VehicleColumns
            return kind(raw=ticks.table(row), **robot)
        raw = ticks.table(_TELEMETRY)
        slow = {
            kind: self._held(kind, rows[name], time, raw["tick"]) for name, kind in MESSAGES.items() if name in rows
        }
        return BoardColumns(raw=raw, slow=slow, **robot)

    def _held(self, kind: Any, block: Block, time: Floats, ticks: NDArray[np.uint32]) -> Held:
        messages = [kind.unpack(data) for _, data in block.rows()]
        came = (np.searchsorted(time, block.times, side="right") - 1).tolist()
        newest, since = newest_messages(came, messages, ticks, restarts(ticks))
        return Held(messages, newest, since * self._tick_s)


def _cut(rows: Group, end_s: float, late_s: float, offset_s: float) -> tuple[dict[str, Block], dict[str, Block]]:
    """What belongs to ticks up to that time, and what is needed from then on."""
    now, rest = {}, {}
    for name, block in rows.items():
        if name == "truth":
            now[name] = block
            begin = bisect.bisect_left(block.times, end_s + offset_s - TRUTH_BEFORE_S)
            rest[name] = block.part(begin, len(block))
            continue
        end = bisect.bisect_right(block.times, end_s)
        is_message = name in MESSAGES
        now[name] = block.part(0, bisect.bisect_right(block.times, late_s) if is_message else end)
        rest[name] = block.part(max(end - 1, 0), len(block))  # the newest one holds
        if is_message and end:
            rest[name] = replace(rest[name], times=np.append(end_s, rest[name].times[1:]))
    return _filled(now), _filled(rest)


def _filled(blocks: Group) -> dict[str, Block]:
    return {name: block for name, block in blocks.items() if len(block)}


def columns(result: Recorded) -> Iterator[Columns]:
    """A recorded run piece by piece, `TICKS` ticks each and a rest; of one without ticks nothing."""
    reader = Reader(result)
    for group in result.record.groups():
        reader.feed(group)
        while reader.ticks > TICKS + LATE_TICKS:
            yield reader.read(TICKS)
    if reader.ticks:
        yield reader.read()


def whole(result: Recorded) -> Columns:
    """The same in one piece."""
    reader = Reader(result)
    for group in result.record.groups():
        reader.feed(group)
    return reader.read()


def events(result: Recorded) -> Iterator[tuple[float, BoardEvent]]:
    """The board's events with their times of the run (s): by the board's clock, as telemetry near them has both."""
    times, board = np.zeros(1), np.zeros(1)
    for group in result.record.groups():
        if "telemetry" in group:
            times = group["telemetry"].times
            board = group["telemetry"].table(_TELEMETRY)["tick"] * result.tick
        for event in map(event_of, group["event"].rows() if "event" in group else ()):
            near = int(np.abs(board - event.time).argmin())
            yield max(0.0, float(times[near] + event.time - board[near])), event
