"""replay.html: one page, offline, that plays and scrubs a run, of one robot or of several. The page itself is
`replay_page.html` beside this file; the run's data are put into it as one JSON object with base64 arrays:

format   number of the data's form, which page and data share
plan     what stands and moves in the arena (boebot.arenas.floor_plan)
runs     one per robot: title, table, paths, flags, readings, what the robot looks like; `mind`, what a brain of
         processes did, or null: processes, utilities, the active motor behavior, the last switch to it

         `shown` and `layers`: what the brain showed and sketched
         `swept`: of each sensor with a fan of rays, its `angles` (rad), and of each sweep its time, the sensor's
         pose and the rays' distances, sweep after sweep (uint16: 65535 is `reach`, in m). To keep the page small, at
         most `RAYS_AT_MOST` rays of a sweep, and every n-th sweep, so that all have at most `SWEPT_AT_MOST` numbers

Arrays are little-endian float32 (`flags` and `motor`: uint8), one entry per frame; those of `mind` one per step of the
brain, fewer where there are very many.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from boebot.description import robots
from boebot.link.messages import Status
from boebot.view import scene, style
from boebot.view.utility_panel import shown_cognitive

if TYPE_CHECKING:
    from boebot.arenas.floor_plan import FloorPlan, Moving, Solid
    from boebot.devices.device import Readout
    from boebot.record.brain_record import BrainRecord
    from boebot.record.result import RunResult
    from boebot.record.series import Floats, Pose
    from boebot.record.shown import Layer, Shown

FORMAT = 8
STEPS_AT_MOST = 6_000  # of a brain of processes
RAYS_AT_MOST = 128  # of a sweep: 2 degrees apart in a fan of 240
SWEPT_AT_MOST = 1_000_000  # numbers of two bytes, of all sweeps of all robots: 2.7 MB of the page
WHOLE = 65535  # such a number for the whole reach
POSE_NUMBERS = 8  # as many of these as time and place of a sweep take
_PAGE = Path(__file__).with_name("replay_page.html")
_PLACEHOLDER = "/*PAGE*/null"

# bits of the page's `flags` array
LEFT_WHISKER, RIGHT_WHISKER, LEFT_IR, RIGHT_IR, CONTACT, DEAD_MAN, MOTORS_OFF, FALLBACK = (1 << bit for bit in range(8))


def write(results: Sequence[RunResult], path: Path) -> Path:
    """Writes the page of the robots of one run."""
    views = [scene.view(result) for result in results]
    low, high = scene.bounds(*views)
    room = SWEPT_AT_MOST // max(1, sum(len(view.swept) for view in views))
    content = {
        "format": FORMAT,
        "plan": plan_data(views[0].plan),
        "bounds": [*low.tolist(), *high.tolist()],
        "runs": [
            run_data(result, view)
            | {"colour": style.colour(number), "swept": [_swept(one, room) for one in view.swept]}
            for number, (result, view) in enumerate(zip(results, views, strict=True), 1)
        ],
    }
    data = json.dumps(content, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    page = _PAGE.read_text(encoding="utf-8")
    path.write_text(page.replace(_PLACEHOLDER, data), encoding="utf-8")
    return path


def plan_data(plan: FloorPlan) -> dict[str, Any]:
    """The plan as the page has it (m, rad)."""
    charger = plan.charger
    return {
        "solids": [_solid(solid) for solid in plan.solids],
        "patches": [
            {"points": _points(patch.corners), "grip": patch.grip, "rough": patch.grip > plan.grip}
            for patch in plan.patches
        ],
        "lines": [{"points": _points(line.points), "width": line.width, "dark": line.is_dark} for line in plan.lines],
        "lamps": [[lamp.x_m, lamp.y_m] for lamp in plan.lamps],
        "charger": None if charger is None else [charger.x_m, charger.y_m, charger.radius_m],
        "moving": [_moving(moving) for moving in plan.moving],
    }


def _solid(solid: Solid) -> dict[str, Any]:
    return {
        "kind": solid.kind,
        "points": _points(solid.points),
        "radius": solid.radius,
        "low": solid.is_low,
        "dull": solid.is_dull,
        "remarks": ", ".join(solid.remarks),
        "top": [float(value) for value in ((solid.box[0][0] + solid.box[1][0]) / 2, solid.box[1][1])],
    }


def _moving(moving: Moving) -> dict[str, Any]:
    """`time` on the clock of the truth, which begins `begin` before a run's own."""
    pose = [_array(row) for row in (moving.x, moving.y, moving.heading)]
    return {"solid": _solid(moving.solid), "time": _array(moving.time), "pose": pose}


def run_data(result: RunResult, view: scene.View) -> dict[str, Any]:
    """What the page shows of one robot."""
    series = result.overview.series
    status = series.status
    flags = (
        series.flag("whisker_left", "pressed") * LEFT_WHISKER
        | series.flag("whisker_right", "pressed") * RIGHT_WHISKER
        | series.flag("infrared_left", "detected") * LEFT_IR
        | series.flag("infrared_right", "detected") * RIGHT_IR
        | result.overview.contact * CONTACT
        | ((status & int(Status.DEAD_MAN)) != 0) * DEAD_MAN
        | ((status & int(Status.MOTORS_ENABLED)) == 0) * MOTORS_OFF
        | ((status & int(Status.FALLBACK)) != 0) * FALLBACK
    )
    return {
        "title": f"{result.brain} on {result.robot.name} ({result.board})",
        "brain": result.brain,
        "begin": result.clock_offset,
        "known": view.known,
        "table": result.table(),
        "way": result.way_in_words(),
        "true_contacts": np.round(view.true_contacts, 4).tolist(),
        "touches": np.round(view.touches, 4).tolist(),
        "robot": _robot(result.robot),
        "time": _array(series.time),
        "path": _pose(view.path),
        "estimate": None if view.estimate is None else _pose(view.estimate),
        "turret": _array(view.turret),
        "left": _array(series.signals[0]),
        "right": _array(series.signals[1]),
        "ping": _array(np.nan_to_num(series.number("ping", "distance"), nan=-1.0)),
        "mind": None if result.overview.brain is None else _mind(result.overview.brain),
        "shown": _shown(result.overview.shown),
        "layers": [_layer(layer, view, index) for index, layer in enumerate(view.layers)],
        "cell": style.CELL,
        "readings": [_reading(readout) for readout in series.readouts()],
        "flags": _flags(flags),
    }


def _shown(shown: Shown) -> dict[str, Any]:
    """What the brain showed: numbers as arrays, texts as indices into the list of all their words."""
    texts = []
    for name, values in shown.texts.items():
        words = sorted(set(values))
        place = {word: index for index, word in enumerate(words)}
        texts.append({"name": name, "words": words, "index": [place[value] for value in values]})
    numbers = [{"name": name, "values": _array(values)} for name, values in shown.numbers.items()]
    return {"time": _array(shown.time), "numbers": numbers, "texts": texts}


def _layer(layer: Layer, view: scene.View, index: int) -> dict[str, Any]:
    """What the brain sketched: arrays of points are x and y in turn (m)."""
    sketches = []
    for sketch in layer.sketches:
        origin = None if sketch.frame == "robot" else view.origin(sketch)  # None: where the robot is
        whole = msgspec.to_builtins(sketch)
        sketches.append({key: whole[key] for key in ("lines", "points", "grid")} | {"origin": origin})
    return {"name": layer.name, "colour": style.layer(index), "time": _array(layer.time), "sketches": sketches}


def _swept(swept: scene.Swept, room: int) -> dict[str, Any]:
    """The sweeps of one sensor, in so many numbers of two bytes at most."""
    count, reach = len(swept.sweeps.angles), swept.sweeps.reach
    rays = np.linspace(0, count - 1, min(count, RAYS_AT_MOST)).round().astype(np.intp)
    sweeps_at_most = max(1, room // (len(rays) + POSE_NUMBERS))
    which = np.arange(0, len(swept.time), max(1, math.ceil(len(swept.time) / sweeps_at_most)))
    shares = np.minimum(swept.distances(which, rays) / reach, 1.0)
    return {
        "reach": reach,
        "time": _array(swept.time[which]),
        "pose": _pose(swept.pose.part(which)),
        "angles": _array(swept.sweeps.angles[rays]),
        "distances": base64.b64encode((shares * WHOLE).round().astype("<u2").tobytes()).decode("ascii"),
    }


def _mind(record: BrainRecord) -> dict[str, Any] | None:
    """A brain of processes: of each kept step its utilities, the active behavior, and why it was switched to."""
    if not len(record):
        return None
    thin = slice(None, None, max(1, math.ceil(len(record) / STEPS_AT_MOST)))
    time, chosen = record.time[thin], [switch for switch in record.switches if switch.on in record.names.behaviors]
    last = np.searchsorted([switch.time for switch in chosen], time, side="right") - 1
    kept = np.unique(last)  # switches between kept steps are left out
    return {
        "behaviors": [
            {"name": name, "colour": style.behavior(index), "utility": _array(record.utility_of(name)[thin])}
            for index, name in enumerate(record.names.behaviors)
        ],
        "cognitive": [
            {"name": name, "utility": _array(record.utility_of(name)[thin])} for name in shown_cognitive(record)
        ],
        "time": _array(time),
        "motor": _flags(record.motor[thin]),
        "switches": [[round(chosen[index].time, 3), chosen[index].on, chosen[index].reason] for index in kept],
    }


def _flags(values: np.ndarray) -> str:
    return base64.b64encode(values.astype(np.uint8).tobytes()).decode("ascii")


def _reading(readout: Readout) -> dict[str, Any]:
    return {
        "name": readout.device.replace("_", " "),
        "unit": readout.unit,
        "digits": readout.digits,
        "values": _array(readout.values),
        "ages": _array(readout.ages),
    }


def _robot(robot: robots.RobotDescription) -> dict[str, Any]:
    """What the page needs to draw the robot (m, rad): its body, and what it has."""
    return {
        "radius": robot.body.radius_m,
        "outline": _points(np.array(robot.body.outline_m).reshape(-1, 2)),  # none: the circle
        "front": robot.body.front_m,
        "track": robot.body.track_width_m,
        "wheel": robot.body.wheel_radius_m,
        "shapes": [
            {"device": device, "form": type(shape).__name__.lower(), **shape._asdict()}
            for device, shape in scene.shapes(robot)
        ],
    }


def _pose(pose: Pose) -> list[str]:
    return [_array(values) for values in (pose.x, pose.y, pose.heading)]


def _points(points: Floats) -> list[list[float]]:
    rounded: list[list[float]] = np.round(points, 4).tolist()
    return rounded


def _array(values: Floats) -> str:
    with np.errstate(over="ignore"):  # what a brain shows may be beyond float32: infinite on the page
        single = values.astype("<f4")
    return base64.b64encode(single.tobytes()).decode("ascii")
