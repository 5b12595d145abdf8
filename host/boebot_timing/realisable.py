"""Whether sensors, brain period and line of a robot are realisable: the notes' timing rule (section 3.2, Fig. 3.2).

All that happens within one time step has to fit, in hardware, into that step:

    sum of t_read + t_process + sum of t_command < dt

Events that follow one another add up. What separate hardware does meanwhile (a timer, the capture input, the converter:
all devices of a board) runs beside them and does not count, but a reading has to fit into the sensor's own period.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from boebot import resources
from boebot.arguments import duration
from boebot.boards import DEFAULT_BAUD
from boebot.description.robots import RobotDescription
from boebot.devices.device import Sensor
from boebot.errors import BoebotError, TimingError
from boebot.link import messages
from boebot.link.frame import FRAME_OVERHEAD
from boebot.running.driver import TICK_S, TIME_TO_LIVE_LIMIT_MS, check_period, check_time_to_live, whole_ticks
from boebot.running.tasks import Finding
from boebot_timing.table import SensorRow, Table, read_table

CLOCK_HZ = 16_000_000  # of the board
TELEMETRY_BYTES = messages.Telemetry.LENGTH + FRAME_OVERHEAD
COMMAND_BYTES = messages.SetpointSignal.LENGTH + FRAME_OVERHEAD
BITS_PER_BYTE = 10  # 8N1
SERVO_FRAME_S = 0.02
BAUD_RATES = (9600, 19200, 38400, 57600, 115200, 230400, 250000, 500000, 1000000)
_LONGEST_PERIOD_S = TIME_TO_LIVE_LIMIT_MS / 2500  # of a brain on a board: 2.5 of them have to fit
_TELEMETRY_TICKS = (1, 2, 5, 10, 20, 50, 100)  # that a slow line leads to (PROTOCOL.md, "Delivery")


@dataclass(frozen=True, slots=True)
class Event:
    """Something that takes time in hardware; `begin` counts from the beginning of the time step."""

    name: str
    kind: str  # "sense", "line", "process", "command"
    seconds: float
    begin: float = 0.0
    every: float = (
        0.0  # of what runs beside the rest: its own period (s); 0: once in a step, after what stands before it
    )

    @property
    def beside(self) -> bool:
        """It runs beside the rest, in separate hardware."""
        return self.every > 0

    @property
    def end(self) -> float:
        """Seconds from the beginning of the step."""
        return self.begin + self.seconds


@dataclass(frozen=True, slots=True)
class BoardTimes:
    """What is known of a board: the rows of its image, and bounds of its work in seconds; 0: not known."""

    sensors: tuple[SensorRow, ...] = ()
    telemetry_s: float = 0.0  # from the beginning of a tick to the first byte of its telemetry
    set_point_s: float = 0.0  # from the last byte of a set-point to its acceptance

    @classmethod
    def of(cls, table: Table) -> BoardTimes:
        """By the budgets of an image's table: tasks up to telemetry's; those of the fullest slot, which go first."""
        names = [row.name for row in table.tasks]
        before = table.tasks[: names.index("telemetry") + 1] if "telemetry" in names else ()
        first = sum(row.budget for row in before if row.phase == 0)
        slots = range(max((row.period for row in table.tasks), default=1))
        fullest = max(sum(row.budget for row in table.tasks if slot % row.period == row.phase) for slot in slots)
        return cls(table.sensors, first / CLOCK_HZ, fullest / CLOCK_HZ)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The answer."""

    robot: str
    period_s: float  # the one that was asked for
    forced_s: float  # the one that a forced run takes: the next for which the line brings telemetry
    baud: int  # 0: no line
    events: tuple[Event, ...]
    faults: tuple[str, ...]  # each a sentence without its end: what breaks, and what would mend it
    notes: tuple[str, ...]

    @property
    def is_realisable(self) -> bool:
        """All events fit."""
        return not self.faults

    @property
    def breaking(self) -> list[str]:
        """The names of the events that do not fit: each fault begins with its event."""
        return [
            event.name
            for event in self.events
            if any(fault.startswith((f"{event.name}, ", f"{event.name} every ")) for fault in self.faults)
        ]

    @property
    def seconds(self) -> float:
        """The critical path: what follows one another in a time step."""
        return sum(event.seconds for event in self.events if not event.beside)

    @property
    def sentence(self) -> str:
        """The answer in one sentence."""
        who = f"robot {self.robot!r} with a brain period of {duration(self.period_s)}"
        if self.faults:
            return f"{who} is not realisable: {'; '.join(self.faults)}"
        if not self.events:
            return f"{who}: nothing is known of its times (no board, no reading_s)"
        return f"{who} is realisable: {duration(self.seconds)} of it are taken"

    def as_dict(self) -> dict[str, object]:
        """For programs; units in the keys."""
        return {
            "robot": self.robot,
            "period_s": round(self.period_s, 6),
            "period_forced_s": round(self.forced_s, 6),
            "baud_rate_bit_s": self.baud or None,
            "taken_s": round(self.seconds, 7),
            "realisable": self.is_realisable,
            "breaking_events": self.breaking,
            "faults": list(self.faults),
            "notes": list(self.notes),
            "events": [
                {
                    "name": event.name,
                    "kind": event.kind,
                    "takes_s": round(event.seconds, 7),
                    "begins_s": round(event.begin, 7),
                    "beside": event.beside,
                    "own_period_s": round(event.every, 7) if event.beside else None,
                }
                for event in self.events
            ],
        }


def judge(
    robot: RobotDescription,
    period_s: float,
    *,
    board: BoardTimes | None = None,
    brain_s: float = 0.0,
    baud: int | None = None,
) -> Verdict:
    """Whether the robot's sensors, that period of its brain and its line go together.

    Args:
        robot: its devices, and their periods.
        period_s: of the brain, s.
        board: what is known of its board's times; None: only the line counts.
        brain_s: what a step of the brain takes, s; 0: not known.
        baud: of the line, bit/s; None: as the robot's description says.

    Raises:
        BoebotError: a period, rate or time that is none.
    """
    check_period(period_s)
    if not (brain_s >= 0 and math.isfinite(brain_s)):
        raise BoebotError(f"a step of the brain cannot take {brain_s * 1000:g} ms; expected 0 or more")
    if baud is not None and not robot.has_board:
        raise BoebotError(f"robot {robot.name!r} has no board, and so no line of {baud} bit/s")
    if not robot.has_board:
        return _of_vehicle(robot, period_s, brain_s)
    return _of_board(robot, period_s, board or BoardTimes(), brain_s, baud)


def check(robot: RobotDescription, period_s: float) -> Finding | None:
    """Whether a run with that period of the brain can keep it (entry point of the group `boebot.checks`)."""
    verdict = judge(robot, period_s, board=of_image(robot))
    return None if verdict.is_realisable else Finding(verdict.sentence, "`boebot timing --robot` shows its times")


def telemetry_ticks(baud: int) -> int:
    """Ticks from telemetry to telemetry: such that it fills no more than half of the line (PROTOCOL.md, "Delivery")."""
    needed = Fraction(2 * TELEMETRY_BYTES * BITS_PER_BYTE, baud)
    return next((ticks for ticks in _TELEMETRY_TICKS if ticks * Fraction(1, 100) >= needed), _TELEMETRY_TICKS[-1])


def of_image(robot: RobotDescription) -> BoardTimes | None:
    """What the image of the robot's pin map says of its times; None: there is none that can be read."""
    image = resources.folder("images") / f"{robot.pin_map}.elf"
    if not robot.has_board or not image.is_file():
        return None
    try:
        return BoardTimes.of(read_table(image))
    except TimingError:
        return None  # who flashes it or runs it on the emulated chip will hear of it


# ---- a robot without a board: one processor does one thing after another -------------------------------------------


def _of_vehicle(robot: RobotDescription, period_s: float, brain_s: float) -> Verdict:
    sensors = {name: device for name, device in robot.device.items() if isinstance(device, Sensor) and device.on}
    timed = {name: device for name, device in sensors.items() if device.reading_s > 0}
    in_turn = [Event(name, "sense", device.reading_s) for name, device in timed.items() if device.period_s == 0]
    beside = [Event(name, "sense", d.reading_s, every=d.period_s) for name, d in timed.items() if d.period_s > 0]
    process = [Event("brain", "process", brain_s)] if brain_s > 0 else []
    events = (*_one_after_another([*in_turn, *process]), *beside)
    faults = [_slow_sensor(event, "period_s") for event in beside if event.seconds >= event.every]
    faults += _overfull(events, period_s, ("own period_s", "which then holds its reading in between"))
    return Verdict(robot.name, period_s, period_s, 0, events, tuple(faults), ())


# ---- a robot with a board: devices beside the critical path of telemetry, brain and set-point -----------------------


def _of_board(
    robot: RobotDescription,
    period_s: float,
    board: BoardTimes,
    brain_s: float,
    baud: int | None,
) -> Verdict:
    rate = baud if baud is not None else robot.baud or DEFAULT_BAUD
    if rate <= 0:
        raise BoebotError(f"a line of {rate} bit/s is none; expected more than 0")
    check_time_to_live(period_s)
    line_s = telemetry_ticks(rate) * TICK_S
    forced_s = _next_multiple(whole_ticks(period_s, TICK_S) * TICK_S, line_s)
    byte_s = BITS_PER_BYTE / rate
    path = [
        Event("telemetry task", "sense", board.telemetry_s),
        Event(f"telemetry, {TELEMETRY_BYTES} B", "line", TELEMETRY_BYTES * byte_s),
        Event("brain", "process", brain_s),
        Event(f"set-point, {COMMAND_BYTES} B", "line", COMMAND_BYTES * byte_s),
        Event("set-point taken", "command", board.set_point_s),
    ]
    beside = [_reading(row, robot) for row in board.sensors if row.conversion > 0 and _has(robot, row)]
    events = (*_one_after_another([event for event in path if event.seconds > 0]), *beside)
    slow = [event for event in beside if event.seconds > event.every + 1e-9]
    faults = [_slow_sensor(event, "period_ticks") for event in slow if _is_asked(robot, event.name)]
    if forced_s > period_s + 1e-9:
        faults.append(_slow_line(events, period_s, rate))
    elif late := _overfull(events, period_s, None, line_s):
        faults += late
        if faster := _faster_line(events, period_s, rate):
            faults.append(f"{faster} would do, too")
    notes = _notes(beside, period_s, forced_s, rate)
    return Verdict(robot.name, period_s, forced_s, rate, events, tuple(faults), notes)


def _next_multiple(period_s: float, grain_s: float) -> float:
    """The least multiple of `grain_s` that is not shorter."""
    return math.ceil(period_s / grain_s - 1e-6) * grain_s


def _has(robot: RobotDescription, row: SensorRow) -> bool:
    """A row of the image is for a device of that name, or for those whose names begin so ("light": light_left)."""
    stem = row.name.removesuffix("s")
    return any(robot.has(name) and (name == stem or name.startswith(f"{stem}_")) for name in robot.device)


def _reading(row: SensorRow, robot: RobotDescription) -> Event:
    """A sensor of the board; the description may say another period than the image's own."""
    ticks = getattr(robot.device.get(row.name), "period_ticks", row.period)
    return Event(row.name, "sense", row.conversion * 1e-6, every=ticks * TICK_S)


def _is_asked(robot: RobotDescription, name: str) -> bool:
    """Its description says how often it is to measure; other sensors measure by themselves, and are read so often."""
    return hasattr(robot.device.get(name), "period_ticks")


def _notes(beside: list[Event], asked_s: float, period_s: float, rate: int) -> tuple[str, ...]:
    """`period_s`: the one that is run, if need be by force."""
    notes = []
    if period_s > asked_s + 1e-9:
        notes.append(f"a forced run steps every {duration(period_s)}: at {rate} bit/s telemetry comes no oftener")
    for event in beside:
        if event.seconds > event.every + 1e-9:
            notes.append(
                f"{event.name}: a reading takes {duration(event.seconds)} and is looked at every "
                f"{duration(event.every)}: it is often the one before"
            )
        elif event.every > period_s + 1e-9 and event.seconds > TICK_S:
            notes.append(
                f"{event.name}: a reading takes {duration(event.seconds)}; it is sampled every "
                f"{duration(event.every)}, and the brain sees each of them {event.every / period_s:.3g} times"
            )
    if period_s < SERVO_FRAME_S - 1e-9:
        notes.append(f"servos take a new pulse every {duration(SERVO_FRAME_S)}: set-points in between go unheeded")
    return tuple(notes)


# ---- what both have in common ----------------------------------------------------------------------------------------


def _one_after_another(events: list[Event]) -> list[Event]:
    begin, placed = 0.0, []
    for event in events:
        placed.append(Event(event.name, event.kind, event.seconds, begin))
        begin += event.seconds
    return placed


def _slow_sensor(event: Event, key: str) -> str:
    ticks = math.floor(event.seconds / TICK_S + 1e-9) + 1
    return (
        f"{event.name} every {duration(event.every)} cannot be, a reading takes {duration(event.seconds)}; "
        f"expected a {key} of at least {ticks if key == 'period_ticks' else ticks * TICK_S:g}"
    )


def _overfull(
    events: tuple[Event, ...], period_s: float, own_period: tuple[str, str] | None, grain_s: float = TICK_S
) -> list[str]:
    """Which event of those that follow one another does not fit any more, and what would mend that; periods are
    multiples of `grain_s`."""
    path = [event for event in events if not event.beside]
    broken = next((event for event in path if event.end >= period_s - 1e-12), None)
    if broken is None:
        return []
    total = path[-1].end
    longest = max(path, key=lambda event: event.seconds)
    mend = [f"a period of {duration(_enough(total, grain_s))}"]
    rest = total - longest.seconds
    if rest < period_s:
        if longest.kind == "process":
            mend.append(f"a step of the brain of less than {duration(period_s - rest)}")
        elif longest.kind == "sense" and own_period is not None:
            mend.append(f"an {own_period[0]} for {longest.name}, {own_period[1]}")
    return [
        f"{broken.name}, {duration(broken.seconds)}, ends {duration(broken.end)} after the step began, "
        f"and all {len(path)} events need {duration(total)}; expected {' or '.join(mend)}"
    ]


def _enough(seconds: float, grain_s: float) -> float:
    """The least period in which so much can happen."""
    return (math.floor(seconds / grain_s + 1e-9) + 1) * grain_s


def _slow_line(events: tuple[Event, ...], period_s: float, rate: int) -> str:
    """A line that does not bring telemetry for each step, and what would mend that."""
    line_s = telemetry_ticks(rate) * TICK_S
    total = sum(event.seconds for event in events if not event.beside)
    longer = max(_next_multiple(period_s, line_s), _enough(total, line_s))
    mend = [f"a period of {duration(longer)}"] if longer <= _LONGEST_PERIOD_S else []
    if faster := _faster_line(events, period_s, rate):
        mend.append(faster)
    return (
        f"telemetry, {TELEMETRY_BYTES} B, comes every {duration(line_s)} over a line of {rate} bit/s, "
        f"which a step every {duration(period_s)} does not go with; expected {' or '.join(mend) or 'a faster line'}"
    )


def _faster_line(events: tuple[Event, ...], period_s: float, rate: int) -> str | None:
    """The lowest usual rate at which there is telemetry for each step, and time enough."""
    rest = sum(event.seconds for event in events if not event.beside and event.kind != "line")
    for faster in BAUD_RATES:
        line_s = telemetry_ticks(faster) * TICK_S
        bytes_s = (TELEMETRY_BYTES + COMMAND_BYTES) * BITS_PER_BYTE / faster
        if faster > rate and _next_multiple(period_s, line_s) <= period_s + 1e-9 and rest + bytes_s < period_s:
            return f"a line of {faster} bit/s"
    return None
