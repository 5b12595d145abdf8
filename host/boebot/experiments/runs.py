"""What experiments that run a robot share: variants of described robots, arenas of their own, true places."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from boebot.device import Device
from boebot.result import RunResult
from boebot.robots import RobotDescription, load_robot
from boebot.series import Pose, truth_at

Floats = NDArray[np.float64]


def variant(robot: str, devices: dict[str, Device], **body: Any) -> RobotDescription:
    """A bundled robot with other devices in place of its own, and another body where that is said."""
    base = load_robot(robot)
    changed = msgspec.structs.replace(base, device=base.device | devices)
    return msgspec.structs.replace(changed, body=msgspec.structs.replace(base.body, **body))


def device(robot: str, name: str, **changes: Any) -> Device:
    """A device of a bundled robot, but for what is said."""
    return msgspec.structs.replace(load_robot(robot).device[name], **changes)


@contextmanager
def arena_file(text: str) -> Iterator[Path]:
    """An arena for as long as runs need it, of that TOML text."""
    with tempfile.TemporaryDirectory(prefix="boebot-") as folder:
        path = Path(folder) / "arena.toml"
        path.write_text(text, encoding="utf-8")
        yield path


def true_pose(result: RunResult, times: Sequence[float] | Floats) -> Pose:
    """Where the robot really was at those times (s of the run)."""
    assert result.truth is not None
    return truth_at(result.truth, np.asarray(times, dtype=np.float64) + result.clock_offset)
