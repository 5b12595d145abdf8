"""What came of a run: figures, arrays, and files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from boebot.boards import Truth
from boebot.link.messages import Identity, Status
from boebot.link.session import text
from boebot.readings import Layout
from boebot.readings_series import ReadingsSeries
from boebot.record import Record
from boebot.robots import RobotDescription
from boebot.series import Pose, Series, onsets, touch_indices, truth_at
from boebot.telemetry_series import TelemetrySeries


@dataclass(kw_only=True)
class RunResult:
    """What came of a run. Lengths in metres, times in seconds.

    Attributes:
        brain, board, arena, seed, period: what was run, and on what.
        robot: its description.
        description: the board in words.
        tick: seconds from one control tick to the next.
        error: why the run ended before its time, or None.
        truth: what really happened, where somebody knows (simulated runs); no brain saw it.
        steps: steps of the brain. late_steps: brain periods that passed without one (live boards only).
        resets: times the board restarted during the run. sessions_lost: times it had to be opened and armed again,
            those included.
        lost_frames, bad_frames: telemetry frames that never came; frames that came damaged.
        run_time: length of the run by the board's clock. wall_time: by the wall clock.
        sent, received: (stamp in s on the transport's clock, bytes), oldest first.
        link: what the two ends of the link counted, "host" and "board".
        without: imperfections of the simulated robot that were switched off.
        notices: what the user should know, in sentences.
        counters: what an emulated board counted.
        layout: of a robot without a board: where the readings of each of its devices stand.
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
    sent: list[tuple[float, bytes]]
    received: list[tuple[float, bytes]]
    sessions_lost: int = 0
    identity: Identity | None = None
    link: dict[str, dict[str, int]] = field(default_factory=dict)
    notices: list[str] = field(default_factory=list)
    counters: dict[str, float] = field(default_factory=dict)
    layout: Layout | None = None
    without: Sequence[str] = ()

    # ---- arrays --------------------------------------------------------------------------------------------

    @cached_property
    def series(self) -> Series:
        """Everything the robot told, as arrays, one entry per control tick received."""
        if self.layout is not None:
            return ReadingsSeries(self.record, self.robot, self.layout)
        return self.telemetry

    @cached_property
    def telemetry(self) -> TelemetrySeries:
        """Everything the board told, with what only a board tells; empty without one."""
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
        start = (0.0, 0.0, 0.0)
        if self.true_pose is not None:
            start = (
                float(self.true_pose.x[0]),
                float(self.true_pose.y[0]),
                float(self.true_pose.heading[0]),
            )
        return self.series.odometry(start)

    @property
    def bytes_from_board(self) -> bytes:
        """Every byte that came from the board."""
        return b"".join(data for _, data in self.received)

    @property
    def bytes_to_board(self) -> bytes:
        """Every byte that went to the board."""
        return b"".join(data for _, data in self.sent)

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
        return onsets(self.series.left_whisker) + onsets(self.series.right_whisker)

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
        return self.series.rising(Status.DEAD_MAN)

    @cached_property
    def odometry_error(self) -> float | None:
        """Distance of the estimate from the true place at the end (m), where somebody knows it and the robot has what
        an estimate needs."""
        measures = ("odometer",) if self.layout is not None else ("encoder_left", "encoder_right")
        if self.true_pose is None or not all(self.robot.has(device) for device in measures):
            return None
        return float(np.hypot(self.odometry.x[-1] - self.true_pose.x[-1], self.odometry.y[-1] - self.true_pose.y[-1]))

    @property
    def real_time_factor(self) -> float:
        """How many times faster than the wall clock the run was."""
        return self.run_time / self.wall_time if self.wall_time > 0 else 0.0

    def table(self) -> dict[str, float | int | str | None]:
        """The run's figures by name, units in the names."""
        return {
            "brain": self.brain,
            "robot": self.robot.name,
            "board": self.board,
            "arena": (self.truth.arena_name if self.truth is not None else self.arena),
            "seed": self.seed,
            "without": ", ".join(self.without) or None,
            "period_ms": round(self.period * 1000, 3),
            "run_time_s": round(self.run_time, 3),
            "distance_m": round(self.distance, 3),
            "contacts": self.contacts,
            "whisker_touches": self.whisker_touches,
            "odometry_error_m": None if self.odometry_error is None else round(self.odometry_error, 3),
            "ticks": self.ticks,
            "steps": self.steps,
            "late_steps": self.late_steps,
            "lost_frames": self.lost_frames,
            "bad_frames": self.bad_frames,
            "overruns": self.overruns,
            "dead_man_stops": self.dead_man_stops,
            "resets": self.resets,
            "sessions_lost": self.sessions_lost,
            "real_time_factor": round(self.real_time_factor, 2),
            "firmware": None if self.identity is None else text(self.identity.firmware_version),
            "compiler": None if self.identity is None else text(self.identity.compiler),
            "image_hash": None
            if self.identity is None or self.identity.image_size == 0
            else f"{self.identity.image_hash:08x}",
            "ended": "complete" if self.error is None else _why(self.error),
        }

    # ---- files ---------------------------------------------------------------------------------------------

    def save(self, folder: str | Path) -> list[Path]:
        """Writes run.csv, summary.json, to_board.bin, to_host.bin, wire.csv, run.png and replay.html; returns
        their paths."""
        from boebot.report import save

        return save(self, Path(folder))


@dataclass(kw_only=True)
class TogetherResult:
    """What came of a run of several robots in one world.

    Attributes:
        robots: a result per robot, in the order of the members.
        error: why the run ended before its time, or None; it says which robot was to blame.
    """

    robots: list[RunResult]
    error: BaseException | None

    def table(self) -> dict[str, Any]:
        """The figures by name: of each robot, and how the run ended."""
        ended = "complete" if self.error is None else _why(self.error)
        return {"robots": [result.table() for result in self.robots], "ended": ended}

    def save(self, folder: str | Path) -> list[Path]:
        """Writes run.png and replay.html with all robots, and the files of each into robot-1, robot-2 and so on;
        returns their paths."""
        from boebot.report import save_together

        return save_together(self, Path(folder))


def _why(error: BaseException) -> str:
    return "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
