"""What came of a run: figures, arrays, and files."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from boebot.boards import Truth, WatchdogReset
from boebot.description.robots import RobotDescription
from boebot.devices.device import SlowDevice
from boebot.devices.readings import Layout
from boebot.devices.whisker import Whisker
from boebot.link.fields import text
from boebot.link.messages import DevicesTelemetry, EventKind, Identity, Status
from boebot.record import figures
from boebot.record.brain_record import BrainRecord
from boebot.record.readings_series import ReadingsSeries
from boebot.record.record import Record
from boebot.record.series import Pose, Series, onsets, touch_indices, truth_at
from boebot.record.telemetry_series import TelemetrySeries
from boebot.running import hangs


@dataclass(kw_only=True, repr=False)
class RunResult:
    """What came of a run. Lengths in metres, times in seconds.

    Attributes:
        brain, board, arena, seed, period: what was run, and on what.
        robot: its description.
        description: the board in words.
        tick: seconds from one control tick to the next.
        error: why the run ended before its time, or None.
        truth: what really happened, where somebody knows (simulated runs); no brain saw it.
        steps: steps of the brain. late_steps: brain periods that passed without one (in real time only).
        long_steps: steps that took longer than the brain's period, by the wall clock, in any run. longest_step: the
            longest of all, in s of the wall clock.
        unrealisable: why sensors, period and line do not go together in time, where the run was forced; else None.
        resets: times the board restarted during the run. sessions_lost: times it had to be opened and armed again,
            those included.
        lost_frames, bad_frames: telemetry frames that never came; frames that came damaged.
        run_time: length of the run by the board's clock. wall_time: by the wall clock.
        link: what the two ends of the link counted, "host" and "board".
        without: imperfections of the simulated robot that were switched off.
        odometry_source: what the brain's own poses came from, where it kept any: "odometer", "encoders", or "commands"
            where the robot has neither.
        notices: what the user should know, in sentences.
        watchdog_resets: where the watchdog of an emulated board found the program, oldest first.
        counters: what an emulated board counted.
        layout: of a robot without a board: where the readings of each of its devices stand.
        brain_record: of a brain of processes: its steps and switches; None: a brain of another kind.
    """

    brain: str
    robot: RobotDescription
    board: str
    description: str
    arena: str | None
    seed: int
    period: float
    tick: float
    error: BaseException | None
    record: Record
    truth: Truth | None
    clock_offset: float
    steps: int
    late_steps: int
    resets: int
    lost_frames: int
    bad_frames: int
    run_time: float
    wall_time: float
    sessions_lost: int = 0
    identity: Identity | None = None
    link: dict[str, dict[str, int]] = field(default_factory=dict)
    notices: list[str] = field(default_factory=list)
    watchdog_resets: Sequence[WatchdogReset] = ()
    counters: dict[str, float] = field(default_factory=dict)
    layout: Layout | None = None
    without: Sequence[str] = ()
    brain_record: BrainRecord | None = None
    odometry_source: str | None = None
    long_steps: int = 0
    longest_step: float = 0.0
    unrealisable: str | None = None

    def __repr__(self) -> str:
        """One line; the figures are in `table()`, everything else in the attributes."""
        return f"<RunResult: {self.summary()}>"

    def _repr_html_(self) -> str:
        """The figures as a table, for notebooks."""
        return figures.html_table(self.table())

    def summary(self) -> str:
        """The run in one line: who, where, how long, how far, how it ended."""
        where = self.table()["arena"]
        parts = [
            f"{self.brain} on {self.robot.name} ({self.board})" + (f" in {where}" if where else ""),
            f"{self.run_time:.1f} s",
            f"{self.distance:.2f} m" if self.has_path else "way unknown",
            f"{self.contacts} contact" + ("" if self.contacts == 1 else "s"),
            f"seed {self.seed}",
            "complete" if self.error is None else f"ended early: {textwrap.shorten(_why(self.error), 120)}",
        ]
        return ", ".join(parts)

    # ---- arrays --------------------------------------------------------------------------------------------

    @cached_property
    def series(self) -> Series:
        """Telemetry or readings as arrays, one entry per control tick received."""
        if self.layout is not None:
            return ReadingsSeries(self.record, self.robot, self.tick, self.layout)
        return self.telemetry

    @cached_property
    def telemetry(self) -> TelemetrySeries:
        """The board's telemetry, with what only boards send; empty without a board."""
        return TelemetrySeries(self.record, self.robot, self.tick)

    @cached_property
    def true_pose(self) -> Pose | None:
        """The true pose at each of those ticks, where somebody knows it."""
        if self.truth is None or not len(self.truth.time) or not len(self.series):
            return None
        return truth_at(self.truth, self.series.time + self.clock_offset)

    @cached_property
    def odometry(self) -> Pose:
        """The pose estimate from encoders and commands at each of those ticks, calibrated once at the start."""
        pose = self.true_pose
        if pose is None:
            return self.series.odometry()
        return self.series.odometry((float(pose.x[0]), float(pose.y[0]), float(pose.heading[0])))

    @property
    def bytes_from_board(self) -> bytes:
        """Every byte that came from the board."""
        return b"".join(data for _, data in self.record.rows("to_host"))

    @property
    def bytes_to_board(self) -> bytes:
        """Every byte that went to the board."""
        return b"".join(data for _, data in self.record.rows("to_board"))

    # ---- figures -------------------------------------------------------------------------------------------

    @cached_property
    def distance(self) -> float:
        """Path length of the robot's centre: the true one where somebody knows it, else by odometry (m)."""
        pose = self.odometry if self.true_pose is None else self.true_pose
        return float(np.hypot(np.diff(pose.x), np.diff(pose.y)).sum())

    @cached_property
    def contacts(self) -> int:
        """How many times the body came to touch something; on a real robot, a whisker."""
        if self.truth is not None and len(self.series):
            begin, end = self.clock_offset, self.clock_offset + float(self.series.time[-1])
            inside = (self.truth.time >= begin) & (self.truth.time <= end)
            return len(touch_indices(self.truth.time[inside], self.truth.contact[inside]))
        return self.whisker_touches

    @cached_property
    def whisker_touches(self) -> int:
        """How many times a whisker was pressed."""
        return sum(onsets(self.series.flag(whisker)) for whisker in self.whiskers)

    @property
    def ticks(self) -> int:
        """Control ticks whose telemetry was received, or steps of a robot without a board."""
        return len(self.record.times)

    @property
    def overruns(self) -> int:
        """Control ticks whose work did not end in time."""
        return self.series.overruns

    @cached_property
    def dead_man_stops(self) -> int:
        """Times the motors stopped because no fresh set-point came."""
        events = sum(event.kind == EventKind.DEAD_MAN for event in self.record.events)
        return max(self.series.rising(Status.DEAD_MAN), events)  # telemetry is not heard while a session is lost

    @cached_property
    def fallback_takeovers(self) -> int:
        """Times the board's own brain took over because the host was silent."""
        events = sum(event.kind == EventKind.FALLBACK and event.value == 1 for event in self.record.events)
        return max(self.series.rising(Status.FALLBACK), events)

    @property
    def has_odometry(self) -> bool:
        """The robot has what an estimate of its pose needs: encoders, or an odometer."""
        measures = ("odometer",) if self.layout is not None else ("encoder_left", "encoder_right")
        return all(self.robot.has(device) for device in measures)

    @property
    def whiskers(self) -> list[str]:
        """Names of the robot's whiskers."""
        return [name for name, device in self.robot.device.items() if device.on and device.READING is Whisker]

    @property
    def has_path(self) -> bool:
        """Somebody knows where the robot went: the simulator, or the robot by its odometry."""
        return self.has_odometry or self.true_pose is not None

    @cached_property
    def odometry_error(self) -> float | None:
        """Distance of the estimate from the true place at the end (m), where somebody knows it and the robot has what
        an estimate needs."""
        if self.true_pose is None or not self.has_odometry:
            return None
        return float(np.hypot(self.odometry.x[-1] - self.true_pose.x[-1], self.odometry.y[-1] - self.true_pose.y[-1]))

    @property
    def real_time_factor(self) -> float:
        """How many times faster than the wall clock the run was."""
        return self.run_time / self.wall_time if self.wall_time > 0 else 0.0

    @cached_property
    def slow_reading_age(self) -> float | None:
        """The greatest age (s) that a slow device's reading (light, compass, battery, ...) had at a step of the brain,
        once it had said something; None without such a device."""
        if self.layout is not None or not self.record.rows(DevicesTelemetry.NAME):
            return None
        steps = np.array([index for index, *_ in self.record.steps], dtype=np.intp)
        slow = [name for name, device in self.robot.device.items() if isinstance(device, SlowDevice)]
        ages = [values[steps[steps < len(values)]] for values in (self.series.number(name, "age") for name in slow)]
        known = np.concatenate([values[~np.isnan(values)] for values in ages]) if ages else np.empty(0)
        return float(known.max()) if len(known) else None

    def table(self) -> dict[str, float | int | str | None]:
        """The run's figures by name, units in the names; None: not known, or nothing that this robot has."""
        on_board = self.layout is None
        slow_age, identity, brain = self.slow_reading_age, self.identity, self.brain_record
        shares = {} if brain is None else brain.shares(self.run_time)
        return {
            "brain": self.brain,
            "robot": self.robot.name,
            "board": self.board,
            "arena": (self.truth.plan.name if self.truth is not None else self.arena),
            "seed": self.seed,
            "without": ", ".join(self.without) or None,
            "run_time_s": round(self.run_time, 3),
            "distance_m": round(self.distance, 3) if self.has_path else None,
            "contacts": self.contacts if self.truth is not None or self.whiskers else None,
            "whisker_touches": self.whisker_touches if self.whiskers else None,
            "odometry": self.odometry_source,
            "odometry_error_m": None if self.odometry_error is None else round(self.odometry_error, 3),
            "period_ms": round(self.period * 1000, 3),
            "steps": self.steps,
            "late_steps": self.late_steps,
            "long_steps": self.long_steps,
            "longest_step_ms": round(self.longest_step * 1000, 3),
            "unrealisable": self.unrealisable,
            "behavior_switches": None if brain is None else len(brain.behavior_switches),
            **{f"{name}_share": round(share, 4) for name, share in shares.items()},
            "ticks": self.ticks,
            "slow_readings": None if slow_age is None else len(self.record.rows(DevicesTelemetry.NAME)),
            "slow_reading_age_ms": None if slow_age is None else round(slow_age * 1000, 3),
            "lost_frames": self.lost_frames if on_board else None,
            "bad_frames": self.bad_frames if on_board else None,
            "overruns": self.overruns if on_board else None,
            "dead_man_stops": self.dead_man_stops if on_board else None,
            "fallback_takeovers": self.fallback_takeovers if on_board else None,
            "resets": self.resets if on_board else None,
            "sessions_lost": self.sessions_lost if on_board else None,
            "hung_at": hangs.places(self.watchdog_resets),
            "real_time_factor": round(self.real_time_factor, 2),
            "firmware": None if identity is None else text(identity.firmware_version),
            "compiler": None if identity is None else text(identity.compiler),
            "image_hash": None if identity is None or identity.image_size == 0 else f"{identity.image_hash:08x}",
            "ended": "complete" if self.error is None else _why(self.error),
        }

    # ---- files ---------------------------------------------------------------------------------------------

    def save(self, folder: str | Path) -> list[Path]:
        """Writes run.csv, summary.json, to_board.bin, to_host.bin, wire.csv, run.png and replay.html, and of a brain
        of processes brain.csv and switches.csv; returns their paths."""
        from boebot.view import save

        return save(self, Path(folder))


@dataclass(kw_only=True, repr=False)
class TogetherResult:
    """What came of a run of several robots in one world.

    Attributes:
        robots: a result per robot, in the order of the members.
        error: why the run ended before its time, or None; it says which robot was to blame.
    """

    robots: list[RunResult]
    error: BaseException | None

    def __repr__(self) -> str:
        """A line for each robot."""
        robots = "".join(f"\n  {number}: {robot.summary()}" for number, robot in enumerate(self.robots, 1))
        return f"<TogetherResult of {len(self.robots)}:{robots}>"

    def _repr_html_(self) -> str:
        """A table for each robot, for notebooks."""
        return "".join(f"<h4>robot {n}</h4>{robot._repr_html_()}" for n, robot in enumerate(self.robots, 1))

    def table(self) -> dict[str, Any]:
        """The figures by name: of each robot, and how the run ended."""
        ended = "complete" if self.error is None else _why(self.error)
        return {"robots": [result.table() for result in self.robots], "ended": ended}

    def save(self, folder: str | Path) -> list[Path]:
        """Writes run.png and replay.html with all robots, and the files of each into robot-1, robot-2 and so on;
        returns their paths."""
        from boebot.view import save_together

        return save_together(self, Path(folder))


def _why(error: BaseException) -> str:
    return "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
