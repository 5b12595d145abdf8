"""What came of the run of one robot: figures and arrays. Its face, with pictures and files, is in boebot.result."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from boebot.arenas import Arena
from boebot.arenas.floor_plan import FloorPlan
from boebot.boards import Truth, WatchdogReset
from boebot.description.robots import RobotDescription
from boebot.devices.battery import Energy
from boebot.devices.readings import Layout
from boebot.devices.whisker import Whisker
from boebot.errors import brief
from boebot.link.frame import text
from boebot.link.messages import Identity
from boebot.record import figures
from boebot.record.brain_record import (
    BrainNames,
    BrainRecord,
    Layer,
    MadeOf,
    Shown,
    read_brain,
    read_layers,
    read_shown,
)
from boebot.record.columns import MESSAGES, Columns, whole
from boebot.record.figures import counted
from boebot.record.interventions import touched
from boebot.record.overview import Overview, overview
from boebot.record.record import Record, Unrecorded
from boebot.record.truth import Pose, plan_of, truth_of

_TEXTS = """brain robot board arena without imperfections parameters odometry_source unrealisable hung_at faults
    firmware compiler image_hash program_hash hash ended"""
_COUNTS = """seed true_contacts whisker_touches steps late_steps behavior_switches ticks slow_readings lost_frames
    bad_frames overruns dead_man_stops fallback_takeovers resets sessions_lost touched"""
_NUMBERS = """run_time_s true_distance_m odometry_distance_m odometry_error_m battery_charge period_s
    slow_reading_age_s"""
FIGURES: Mapping[str, type] = {
    name: kind for kind, names in ((str, _TEXTS), (int, _COUNTS), (float, _NUMBERS)) for name in names.split()
}
"""The figures of any run (`Run.table`) by name, each with its type where it is not None. A run of a brain of processes
has one more for each behavior, a float: its name and SHARE."""
SHARE = "_share"


@dataclass(kw_only=True, repr=False)
class Run:
    """What came of a run. Lengths in metres, times in seconds.

    Attributes:
        brain, board, arena, seed, period: what was run, and on what.
        robot: its description.
        description: the board in words.
        tick: seconds from one control tick to the next.
        error: why the run ended before its time, or None.
        world: the arena, where somebody knows it (simulated runs).
        steps: steps of the brain. late_steps: brain periods that passed without one (in real time only). This and what
            else is counted up to the run's end is None where it is not known, as of a record that is cut.
        long_steps: steps that took longer than the brain's period, by the wall clock, in any run. longest_step: the
            longest of all, in s of the wall clock.
        unrealisable: why sensors, period and line do not go together in time, where the run was forced; else None.
        resets: times the board restarted during the run. sessions_lost: times it had to be opened and armed again,
            those included. lost_frames, bad_frames: telemetry frames that never came; frames that came damaged. None
            without a board.
        run_time: length of the run by the board's clock. wall_time: by the wall clock.
        link: what the two ends of the link counted, "host" and "board".
        without: imperfections of the simulated robot that were switched off. imperfections: magnitudes of others that
            the run was given, by name; those of the robot's file are in `robot`.
        odometry_source: what the brain's own poses came from, where it kept any: "odometer", "encoders", or "commands"
            where the robot has neither.
        notices: what the user should know, in sentences.
        watchdog_resets: where the watchdog of an emulated board found the program, oldest first.
        counters: what an emulated board counted.
        layout: of a robot without a board: where the readings of each of its devices stand.
        brain_names: of a brain of processes: names of its parts; None: a brain of another kind.
        parameters: of the brain that were set for this run, by name, as "avoid.turn".
        program: SHA-256 of the file of the program that drove the robot in place of firmware and brain, in hexadecimal
            digits; None: a brain did.
        faults: what was made to fail, as in "ping.missing@3s..5s", and how often each has changed something.
        made_of: of a brain of processes: classes and parameters of its processes, their utilities, and state variables,
            as the run began (docs/reference/run-files.md).
    """

    brain: str
    robot: RobotDescription
    board: str
    description: str
    arena: str | None
    seed: int
    period: float
    tick: float
    record: Record
    world: Arena | None
    error: BaseException | None = None
    clock_offset: float = 0.0
    steps: int = 0
    run_time: float = 0.0
    late_steps: int | None = None
    resets: int | None = None
    lost_frames: int | None = None
    bad_frames: int | None = None
    wall_time: float | None = None
    sessions_lost: int | None = None
    identity: Identity | None = None
    link: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    notices: Sequence[str] = ()
    watchdog_resets: Sequence[WatchdogReset] = ()
    counters: dict[str, int | float | None] = field(default_factory=dict)
    layout: Layout | None = None
    without: Sequence[str] = ()
    imperfections: Mapping[str, float] = field(default_factory=dict)
    brain_names: BrainNames | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)
    made_of: MadeOf | None = None
    odometry_source: str | None = None
    long_steps: int | None = None
    longest_step: float | None = None
    unrealisable: str | None = None
    program: str | None = None
    faults: Mapping[str, int] = field(default_factory=dict)

    def __repr__(self) -> str:
        """One line; the figures are in `table()`, everything else in the attributes."""
        return f"<{type(self).__name__}: {self.summary()}>"

    @property
    def title(self) -> str:
        """Who, on what."""
        return f"{self.brain} on {self.robot.name} ({self.board})"

    def summary(self) -> str:
        """The run in one line: who, where, how long, how far, how it ended."""
        where = self.table()["arena"]
        parts = [
            self.title + (f" in {where}" if where else ""),
            f"{self.run_time:.1f} s",
            *self.way_in_words(),
            f"seed {self.seed}",
            "complete" if self.error is None else f"{brief(self.error)[0]}: {textwrap.shorten(why(self.error), 120)}",
        ]
        return ", ".join(parts)

    def way_in_words(self) -> list[str]:
        """How far it went and what it touched, in a few words. The distance is the true one where a simulator knows it,
        else that by odometry."""
        if self.true_distance is not None:
            parts = [f"true distance {self.true_distance:.2f} m"]
        elif self.odometry_distance is not None:
            parts = [f"odometry distance {self.odometry_distance:.2f} m"]
        else:
            parts = ["distance unknown"]
        if self.true_contacts is not None:
            parts.append(counted(self.true_contacts, "true contact", "true contacts"))
        if self.whisker_touches is not None:
            parts.append(counted(self.whisker_touches, "whisker touch", "whisker touches"))
        return parts

    # ---- arrays --------------------------------------------------------------------------------------------

    @cached_property
    def truth(self) -> Truth | None:
        """What really happened, where somebody knows (simulated runs); no brain saw it."""
        return truth_of(self.record, self.plan) if self.has_truth else None

    @property
    def has_truth(self) -> bool:
        """A simulator knows what really happened."""
        return self.world is not None and self.record.count("truth") > 0

    @cached_property
    def plan(self) -> FloorPlan:
        """The arena from above, with its moving shapes where they were; an empty one where nobody knows it."""
        return plan_of(self.record, self.world) if self.world is not None else FloorPlan()

    @cached_property
    def series(self) -> Columns:
        """Telemetry or readings as arrays, one entry per control tick received."""
        return whole(self)

    @property
    def true_pose(self) -> Pose | None:
        """The true pose at each of those ticks, where somebody knows it."""
        return self.series.true_pose

    @property
    def odometry(self) -> Pose | None:
        """Where the robot is by encoders or odometer at each of those ticks, as seen from where the run began: there it
        is at 0, 0 and heads along x. None: it has neither."""
        return self.series.odometry

    @cached_property
    def brain_record(self) -> BrainRecord | None:
        """Steps and switches of a brain of processes; None: a brain of another kind, or not recorded."""
        names = self.brain_names if self.is_recorded else None
        return None if names is None else read_brain(self.record, names)

    @cached_property
    def shown(self) -> Shown:
        """The values that the brain showed (`robot.show`)."""
        return read_shown(self.record)

    @cached_property
    def layers(self) -> list[Layer]:
        """What the brain sketched (`robot.sketch`), layer by layer."""
        return read_layers(self.record, None)

    # ---- figures -------------------------------------------------------------------------------------------

    @cached_property
    def overview(self) -> Overview:
        """What tables, pictures and pages show of it; takes no more memory for a long run than for a short one."""
        return overview(self, self.whiskers, self.brain_names if self.is_recorded else None)

    @property
    def true_distance(self) -> float | None:
        """True path length of the robot's centre (m); None: no simulator knows it."""
        return self.overview.true_distance

    @property
    def odometry_distance(self) -> float | None:
        """Path length of the robot's centre by its encoders or odometer (m); None: it has neither.

        It goes through places 0.1 s apart: in closer ones each edge of one encoder counts as a move of the centre.
        """
        return self.overview.odometry_distance

    @property
    def true_contacts(self) -> int | None:
        """How many times the body came to touch something, 0.1 s apart at least; None: no simulator knows it."""
        return self.overview.true_contacts

    @property
    def whisker_touches(self) -> int | None:
        """How many times a whisker was pressed; None: the robot has none."""
        return self.overview.whisker_touches

    @property
    def is_recorded(self) -> bool:
        """Else few figures are known: those that need the record are None."""
        return not isinstance(self.record, Unrecorded)

    @cached_property
    def hash(self) -> str | None:
        """SHA-256 of what really happened and of what the brain commanded, step by step, in hexadecimal digits; of a
        real robot of the commands; where a program drove it, of what it printed in place of commands. Runs that are
        equal have the same (docs/reference/run-files.md). Of a record that is cut: of what it holds. None: the run was
        not recorded."""
        return self.record.digest("truth", "to_host" if self.program else "command") if self.is_recorded else None

    @property
    def ticks(self) -> int | None:
        """Control ticks whose telemetry was received, or steps of a robot without a board; None: not recorded."""
        return self.record.ticks if self.is_recorded else None

    @property
    def whiskers(self) -> list[str]:
        """Names of the robot's whiskers that are read; none where a program drives it, which does not say."""
        if self.program:
            return []
        return [name for name, device in self.robot.device.items() if device.on and device.READING is Whisker]

    @property
    def placed_odometry(self) -> Pose | None:
        """The odometry as it lies in the arena, from the true pose at the start; None: there is no truth, or no
        odometry."""
        return self.series.placed_odometry

    @property
    def odometry_error(self) -> float | None:
        """Distance of the estimate from the true place at the end (m); None: there is no truth, or no odometry."""
        pose, placed = self.overview.columns.true_pose, self.overview.columns.placed_odometry
        return None if pose is None or placed is None else math.dist(placed.at(-1)[:2], pose.at(-1)[:2])

    @property
    def battery_charge(self) -> float | None:
        """What is left in the battery at the end, 0 (empty) to 1 (full), by the last voltage that the robot measured:
        between those of the empty and the full pack at rest, as its file has them. None: it measures none."""
        pack = self.robot.device.get("battery")
        rest = pack if isinstance(pack, Energy) else self.robot.supply
        measured = self.overview.columns.number("battery", "voltage")
        measured = measured[~np.isnan(measured)]
        if rest is None or not len(measured):
            return None
        share = (float(measured[-1]) - rest.empty_v) / (rest.full_v - rest.empty_v)
        return min(max(share, 0.0), 1.0)

    @property
    def real_time_factor(self) -> float | None:
        """How many times faster than the wall clock the run was; None: not known, as of a record that is cut."""
        return self.run_time / self.wall_time if self.wall_time else None

    def table(self) -> dict[str, Any]:
        """The run's figures by name (FIGURES): numbers and texts, units in the names; None: not known, or nothing that
        this robot has. Runs that are equal have equal ones: what depends on this computer's speed is in
        `wall_clock`."""
        few, identity = self.overview, self.identity
        brain, on_board = few.brain, self.layout is None and self.is_recorded
        unknown = dict.fromkeys(() if self.brain_names is None else self.brain_names.behaviors)
        shares: Mapping[str, float | None] = unknown if brain is None else brain.shares(self.run_time)
        return {
            "brain": self.brain,
            "robot": self.robot.name,
            "board": self.board,
            "arena": self.arena if self.world is None else self.plan.described.name,
            "seed": self.seed,
            "without": ", ".join(self.without) or None,
            "imperfections": ", ".join(f"{name} {size:.10g}" for name, size in self.imperfections.items()) or None,
            "parameters": ", ".join(f"{name} {value}" for name, value in self.parameters.items()) or None,
            "run_time_s": round(self.run_time, 3),
            "true_distance_m": _rounded(self.true_distance, 3),
            "odometry_distance_m": _rounded(self.odometry_distance, 3),
            "true_contacts": self.true_contacts,
            "whisker_touches": self.whisker_touches,
            "odometry_source": self.odometry_source,
            "odometry_error_m": _rounded(self.odometry_error, 3),
            "battery_charge": _rounded(self.battery_charge, 3),
            "period_s": None if self.program else round(self.period, 6),
            "steps": None if self.program else self.steps,
            "late_steps": self.late_steps,
            "unrealisable": self.unrealisable,
            "behavior_switches": None if brain is None else brain.behavior_switches,
            **{f"{name}{SHARE}": _rounded(share, 4) for name, share in shares.items()},
            "ticks": None if self.program else self.ticks,
            "slow_readings": None if few.slow_reading_age is None else sum(map(self.record.count, MESSAGES)),
            "slow_reading_age_s": _rounded(few.slow_reading_age, 6),
            "lost_frames": self.lost_frames,
            "bad_frames": self.bad_frames,
            "overruns": few.overruns if on_board else None,
            "dead_man_stops": few.dead_man_stops if on_board else None,
            "fallback_takeovers": few.fallback_takeovers if on_board else None,
            "resets": self.resets,
            "sessions_lost": self.sessions_lost,
            "touched": self.touched,
            "hung_at": figures.hang_places(self.watchdog_resets),
            "faults": ", ".join(f"{name} fired {count}" for name, count in self.faults.items()) or None,
            "firmware": None if identity is None else text(identity.firmware_version),
            "compiler": None if identity is None else text(identity.compiler),
            "image_hash": None if identity is None or identity.image_size == 0 else f"{identity.image_hash:08x}",
            "program_hash": self.program,
            "hash": self.hash,
            "ended": "complete" if self.error is None else why(self.error),
        }

    def wall_clock(self) -> dict[str, Any]:
        """Figures by the wall clock of the computer, in which runs that are equal differ; None: not known."""
        return {
            "wall_time_s": _rounded(self.wall_time, 3),
            "real_time_factor": _rounded(self.real_time_factor, 2),
            "long_steps": None if self.program else self.long_steps,
            "longest_step_s": None if self.program else _rounded(self.longest_step, 6),
        }

    @property
    def touched(self) -> int | None:
        """How often a person interfered with the run through a live view: drove by hand, lifted the robot, changed a
        parameter. None: not recorded."""
        return touched(self.record) if self.is_recorded else None


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)


def why(error: BaseException) -> str:
    """Why a run ended before its time, in words."""
    return "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
