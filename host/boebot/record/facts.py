"""What a record says of its run besides the streams: who ran where, and what was counted. As JSON, in attachments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

import msgspec

from boebot.arenas import Arena
from boebot.boards import WatchdogReset
from boebot.brain.composition import MadeOf
from boebot.description.robots import RobotDescription
from boebot.errors import BoebotError
from boebot.link.messages import Identity
from boebot.record.brain_record import BrainNames
from boebot.record.record import Record
from boebot.record.run import Run, why

R = TypeVar("R", bound=Run)


class RecordedError(BoebotError):
    """Why a run ended before its time, as its record says."""


class Facts(msgspec.Struct, frozen=True, kw_only=True):
    """Of one robot's run; what is not said here is as in `Run`.

    Attributes:
        error: in words.
        identity: the message, in hexadecimal digits.
        layout: first reading, and the one after the last, of each device.
        processes, behaviors, variables: names, of a brain of processes.
    """

    brain: str
    robot: RobotDescription
    board: str
    description: str
    arena: str | None
    seed: int
    period: float
    tick: float
    clock_offset: float
    steps: int
    late_steps: int | None
    resets: int | None
    lost_frames: int | None
    bad_frames: int | None
    run_time: float
    wall_time: float | None
    sessions_lost: int | None
    link: dict[str, dict[str, int]]
    notices: list[str]
    watchdog_resets: list[WatchdogReset]
    counters: dict[str, int | float | None]
    without: list[str]
    imperfections: dict[str, float]
    odometry_source: str | None
    long_steps: int | None
    longest_step: float | None
    unrealisable: str | None
    error: str | None
    interrupted: bool
    identity: str | None
    layout: dict[str, tuple[int, int]] | None
    processes: list[str] | None
    behaviors: list[str]
    variables: list[str]
    parameters: dict[str, Any]
    made_of: MadeOf | None


_CHANGED = ("error", "interrupted", "identity", "layout", "processes", "behaviors", "variables")
_SAME = [name for name in Facts.__struct_fields__ if name not in _CHANGED]


def facts_of(result: Run) -> Facts:
    """Of a result."""
    brain, layout = result.brain_names, result.layout
    same: dict[str, Any] = {name: getattr(result, name) for name in _SAME}
    return Facts(
        **same | {name: list(same[name]) for name in ("notices", "watchdog_resets", "without")},
        error=None if result.error is None else why(result.error),
        interrupted=isinstance(result.error, KeyboardInterrupt),
        identity=None if result.identity is None else result.identity.pack().hex(),
        layout=None if layout is None else {name: (part.start, part.stop) for name, part in layout.items()},
        processes=None if brain is None else list(brain.processes),
        behaviors=[] if brain is None else list(brain.behaviors),
        variables=[] if brain is None else list(brain.variables),
    )


def result_of(kind: type[R], data: Mapping[str, Any], record: Record, world: Arena | None) -> R:
    """The result of that JSON, its record and the arena, as a run of that class.

    Raises:
        ValueError: it is not what `facts_of` makes.
    """
    facts = msgspec.convert(data, Facts)
    error: BaseException | None = None
    if facts.error is not None:
        error = KeyboardInterrupt() if facts.interrupted else RecordedError(facts.error)
    processes = facts.processes
    return kind(
        **{name: getattr(facts, name) for name in _SAME},
        record=record,
        world=world,
        error=error,
        identity=None if facts.identity is None else Identity.unpack(bytes.fromhex(facts.identity)),
        layout=None if facts.layout is None else {name: slice(*part) for name, part in facts.layout.items()},
        brain_names=None
        if processes is None
        else BrainNames(tuple(processes), tuple(facts.behaviors), tuple(facts.variables)),
    )
