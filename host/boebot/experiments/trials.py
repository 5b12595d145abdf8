"""Trials: one brain run again and again on a robot in an arena, and what the world knows of each run afterwards.

Not an experiment itself. Robots as the notes' experiments vary them, arenas written down for one experiment, and
pictures of many paths in one arena are here too.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from boebot.robots import RobotDescription, load_robot
from boebot.runner import run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from boebot.brain import Brain
    from boebot.result import RunResult

Floats = NDArray[np.float64]
PER_SEED = 1000
"""Trials of one experiment have the seeds from PER_SEED times the experiment's on."""


@dataclass(frozen=True)
class Trial:
    """One run and the brain that made it."""

    result: RunResult
    brain: Brain
    """as it was at the end"""

    @cached_property
    def time(self) -> Floats:
        """s since the run began, of each sample of the path"""
        return np.asarray(self.result.series.time)

    @cached_property
    def path(self) -> Floats:
        """The true way of the robot's middle (m), shape (n, 2)."""
        pose = self.result.true_pose
        assert pose is not None, "experiments run in the simulator"
        return np.column_stack((pose.x, pose.y))

    @cached_property
    def first_contact(self) -> float:
        """When the body first touched something (s); NaN: never."""
        truth = self.result.truth
        assert truth is not None
        times = truth.time[truth.contact] - self.result.clock_offset
        inside = times[(times >= 0) & (times <= self.result.run_time)]
        return float(inside[0]) if len(inside) else math.nan

    @property
    def has_collided(self) -> bool:
        """The body touched something during the run."""
        return not math.isnan(self.first_contact)

    @property
    def way(self) -> float:
        """How far it went (m)."""
        return float(np.hypot(*np.diff(self.path, axis=0).T).sum())

    def times_on(self, process: str) -> int:
        """How often a motor behavior became active."""
        return sum(switch.on == process for switch in self.brain.switches)

    def when_active(self, process: str) -> NDArray[np.bool_]:
        """At which samples of the path that motor behavior was active."""
        at = np.array([step.time for step in self.brain.steps])
        active = np.array([step.motor == process for step in self.brain.steps])
        return np.asarray(active[np.clip(np.searchsorted(at, self.time, side="right") - 1, 0, len(at) - 1)])


def try_once(brain: Brain, robot: str | RobotDescription, arena: str | Path, seconds: float, **terms: Any) -> Trial:
    """One run; `terms` as of `boebot.run`.

    Raises:
        BoebotError: the run did not come to its end.
    """
    return Trial(run(brain, robot=robot, arena=arena, seconds=seconds, **terms), brain)


# ---- robots ----------------------------------------------------------------------------------------------------------


def varied(robot: str, name: str, **changes: dict[str, Any]) -> RobotDescription:
    """A bundled robot under another name, with other keys in some of its devices."""
    described = load_robot(robot)
    devices = dict(described.device)
    for device, keys in changes.items():
        devices[device] = msgspec.structs.replace(devices[device], **keys)
    return msgspec.structs.replace(described, name=name, device=devices)


def at_angle(radius: float, angle: float) -> dict[str, Any]:
    """Keys of a sensor on a round body's rim that looks outwards (m, rad), (3.9)."""
    return {"position_m": (radius * math.cos(angle), radius * math.sin(angle)), "heading_rad": angle}


# ---- arenas ----------------------------------------------------------------------------------------------------------


@contextmanager
def arena_file(name: str, text: str) -> Iterator[Path]:
    """A file of an arena that exists for as long as it is needed; its keys are those of docs/reference/arenas.md."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.toml"
        path.write_text(f'name = "{name}"\n{text}', encoding="utf-8")
        yield path


# ---- pictures --------------------------------------------------------------------------------------------------------


def floor(axes: Axes, trial: Trial, *places: Floats) -> None:
    """Draws the arena of a run, wide enough for its walls or, in the open, for those places (m, shape (n, 2))."""
    from boebot.report import scene
    from boebot.report.arena_drawing import draw_arena, frame

    assert trial.result.truth is not None
    plan = trial.result.truth.plan
    if plan.outlines:
        low, high = scene.plan_bounds(plan, [])
    else:
        points = np.vstack(places)
        edge = 0.15 * float(np.ptp(points, axis=0).max())
        low, high = points.min(axis=0) - edge, points.max(axis=0) + edge
    frame(axes, low, high)
    draw_arena(axes, plan)


def draw_paths(axes: Axes, trials: Sequence[Trial]) -> None:
    """All paths, each up to its first contact, which a cross marks; the robot stands where the first one begins."""
    from boebot.report import style
    from boebot.report.robot_drawing import draw_robot

    floor(axes, trials[0])
    for number, trial in enumerate(trials, 1):
        last = np.searchsorted(trial.time, trial.first_contact) if trial.has_collided else len(trial.time) - 1
        path = trial.path[: int(last) + 1]
        axes.plot(*path.T, color=style.colour(number), lw=1.1, alpha=0.85, zorder=6)
        if trial.has_collided:
            axes.plot(*path[-1], "x", color=style.CONTACT, ms=7, mew=1.8, zorder=13)
    draw_robot(axes, trials[0].result.robot, start_of(trials[0]), style.START)


def start_of(trial: Trial) -> tuple[float, float, float]:
    """Where the robot began: m, m, rad."""
    return _pose(trial, 0)


def end_of(trial: Trial) -> tuple[float, float, float]:
    """And where it ended."""
    return _pose(trial, -1)


def _pose(trial: Trial, index: int) -> tuple[float, float, float]:
    pose = trial.result.true_pose
    assert pose is not None
    return float(pose.x[index]), float(pose.y[index]), float(pose.heading[index])
