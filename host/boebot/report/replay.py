"""replay.html: one page, offline, that plays and scrubs a run, of one robot or of several. The page itself is
`replay_page.html` beside this file; the run's data are put into it as base64 arrays."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boebot import robots, vehicle_devices
from boebot.link.messages import Status
from boebot.report import scene

if TYPE_CHECKING:
    from boebot.result import RunResult
    from boebot.series import Floats, Pose

FRAMES_AT_MOST = 20_000
_PAGE = Path(__file__).with_name("replay_page.html")
_PLACEHOLDER = "/*RUNS*/null"

# bits of the page's `flags` array
LEFT_WHISKER, RIGHT_WHISKER, LEFT_IR, RIGHT_IR, CONTACT, DEAD_MAN, MOTORS_OFF = (1 << bit for bit in range(7))


def write(results: Sequence[RunResult], path: Path) -> Path:
    """Writes the page of the robots of one run."""
    robots = [page_data(result) | {"colour": scene.colour(number)} for number, result in enumerate(results, 1)]
    data = json.dumps(robots, separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
    page = _PAGE.read_text(encoding="utf-8")
    path.write_text(page.replace(_PLACEHOLDER, data), encoding="utf-8")
    return path


def page_data(result: RunResult) -> dict[str, Any]:
    """What the page shows of one robot. Arrays are base64 of little-endian float32 (`flags`: uint8), by frame."""
    view = scene.view(result)
    series = result.series
    thin = slice(None, None, max(1, math.ceil(len(series) / FRAMES_AT_MOST)))
    low, high = scene.bounds(view)
    status = series.status
    flags = (
        series.left_whisker * LEFT_WHISKER
        | series.right_whisker * RIGHT_WHISKER
        | series.left_ir * LEFT_IR
        | series.right_ir * RIGHT_IR
        | _contact(result) * CONTACT
        | ((status & int(Status.DEAD_MAN)) != 0) * DEAD_MAN
        | ((status & int(Status.MOTORS_ENABLED)) == 0) * MOTORS_OFF
    )
    return {
        "title": f"{result.brain} on {result.board}",
        "brain": result.brain,
        "begin": result.clock_offset,
        "known": view.known,
        "table": result.table(),
        "bounds": [*low.tolist(), *high.tolist()],
        "outlines": [np.round(outline, 4).tolist() for outline in view.outlines],
        "contacts": np.round(view.contacts, 4).tolist(),
        "touches": np.round(view.touches, 4).tolist(),
        "robot": _robot(result.robot),
        "time": _array(series.time[thin]),
        "path": _pose(view.path, thin),
        "estimate": None if view.estimate is None else _pose(view.estimate, thin),
        "left": _array(series.left_signal[thin]),
        "right": _array(series.right_signal[thin]),
        "ping": _array(np.nan_to_num(series.ping_distance[thin], nan=-1.0)),
        "flags": base64.b64encode(flags[thin].astype(np.uint8).tobytes()).decode("ascii"),
    }


def _robot(robot: robots.RobotDescription) -> dict[str, Any]:
    """What the page needs to draw the robot (m, rad)."""
    drawn: dict[str, Any] = {
        "radius": robot.body.radius_m,
        "track": robot.body.track_width_m,
        "wheel": robot.body.wheel_radius_m,
    }
    for name, device in robot.device.items():
        if not device.on:
            continue
        if isinstance(device, robots.Whisker | vehicle_devices.TouchWhisker):
            drawn[name] = {"root": device.root_m, "tip": device.tip_m}
        elif isinstance(device, scene.RANGING):
            reach = scene.reach(device)
            drawn[name] = {
                "position": device.position_m,
                "heading": device.heading_rad,
                "beam": device.beam_rad,
                "range": reach,
            }
    return drawn


def _contact(result: RunResult) -> np.ndarray:
    """Whether the body touched something, at each tick."""
    if result.truth is None or not len(result.truth.time):
        return np.zeros(len(result.series), dtype=np.uint8)
    moment = np.searchsorted(result.truth.time, result.series.time + result.clock_offset)
    contact = result.truth.contact[np.minimum(moment, len(result.truth.contact) - 1)]
    return np.asarray(contact, dtype=np.uint8)


def _pose(pose: Pose, thin: slice) -> list[str]:
    return [_array(values[thin]) for values in (pose.x, pose.y, pose.heading)]


def _array(values: Floats) -> str:
    return base64.b64encode(values.astype("<f4").tobytes()).decode("ascii")
