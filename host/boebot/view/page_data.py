"""What the page of a run gets, of a replay and of a live view alike: of each robot what does not change (`robot_data`),
and *rows*, what it did in some stretch of time (`rows_data`). A replay has the whole run in one stretch; a live view
sends a stretch of a few ticks many times a second, and the page appends them.

plan     display lists (boebot.devices.drawing) of what stands in the arena; `moving`: of the moving shapes in their own
         frames
bounds   of what there is to see, from where the page fits its view
runs     one per robot: `robot_data`, with its `rows`
moving   poses of the moving shapes, on the clock of the truth, which begins `begin` before a run's own
live     null; or what can be done while the run goes on (boebot.live)

Of rows: `state` as of `states`; `contact`: 1 where the body has touched something; `signs`: which devices are on;
`shown` and `layers`: what the brain showed and sketched; `mind`: what a brain of processes did, or null; `events`:
time, kind ("contact", "touch", "fault", "lost", "reset" or "intervention") and a text, to which the page adds the
switches of `mind`; `printed`: what a program printed, line by line with its time, but in a live view, which shows what
comes; `pins`: output edges of a board's pins, where they were recorded (`time`: float64); `swept`: of each
sensor with a fan of rays, of each sweep its time, the sensor's pose and the rays' distances, sweep after sweep (uint16:
65535 is `reach`, in m), of at most `RAYS_AT_MOST` rays.

Arrays are little-endian float32 in base64 (`state`, `contact`, `signs`, `motor` and `level`: uint8), one entry per
tick; those of `mind` one per step of the brain.
"""

from __future__ import annotations

import base64
import math
from collections import deque
from collections.abc import Mapping, Sequence
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from boebot.description import robots
from boebot.description.wiring import named_pins
from boebot.devices.drawing import Item
from boebot.link.messages import Status
from boebot.record.interventions import happenings
from boebot.record.monitor import Monitor
from boebot.record.truth import touch_indices
from boebot.view import scene, style

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from boebot.arenas.floor_plan import FloorPlan, Moving
    from boebot.devices.device import Readout
    from boebot.record.blocks import Block
    from boebot.record.brain_record import BrainRecord, Layer, Shown
    from boebot.record.columns import Columns
    from boebot.record.record import Record
    from boebot.record.run import Run
    from boebot.record.truth import Bools, Floats, Pose

RAYS_AT_MOST = 128  # of a sweep: 2 degrees apart in a fan of 240
WHOLE = 65535  # such a number for the whole reach
COGNITIVE_AT_MOST = 4  # more cognitive processes are not shown
EVENTS_AT_MOST = 2_000  # of a stretch
LINES_AT_MOST = 10_000  # that a program printed: its last ones
EDGES_AT_MOST = 50_000  # of a pin in a stretch: its first ones

FAULTS = {
    Status.DEAD_MAN: "motors stopped by the dead-man",
    Status.LATCHED: "motors latched off",
    Status.TICK_OVERRUN: "a control tick took too long",
    Status.RECEIVE_OVERRUN: "the board lost received bytes",
    Status.WATCHDOG_RESET: "the watchdog reset the board",
    Status.SUPPLY_LOW: "the supply is low",
    Status.FALLBACK: "the board's own brain took over",
}
GAP = 1.5  # usual steps in time from tick to tick: from here on frames are missing

Event = tuple[float, str, str]
"""Time (s), kind, text."""


# ---- what does not change --------------------------------------------------------------------------------------------


def plan_data(plan: FloorPlan) -> dict[str, Any]:
    """The plan as the page has it (m, rad): display lists."""
    return {
        "items": [_item(item) for item in scene.arena_items(plan)],
        "outlines": [_points(outline.points) for outline in plan.outlines],
        "moving": [_item(scene.moving_item(moving.solid)) for moving in plan.moving],
    }


def robot_data(
    result: Run, view: scene.View, number: int, *, table: Mapping[str, Any], way: Sequence[str] = ()
) -> dict[str, Any]:
    """What the page knows of a robot from the start.

    Args:
        result: its run, of whose record nothing is read.
        view: any of its ticks, even none: which readings and sweeps it has.
        number: of the robot in the run, from 1.
        table, way: as `Run` has them.
    """
    series, names = view.columns, result.brain_names
    mind = names and {
        "behaviors": [{"name": name, "colour": style.behavior(index)} for index, name in enumerate(names.behaviors)],
        "cognitive": [{"name": name} for name in names.cognitive[:COGNITIVE_AT_MOST]],
    }
    return {
        "title": result.title,
        "brain": result.brain,
        "program": result.program is not None,
        "begin": result.clock_offset,
        "known": view.known,
        "table": table,
        "way": list(way),
        "robot": _robot(result.robot),
        "colour": style.colour(number),
        "cell": style.CELL,
        "has_estimate": view.estimate is not None,
        "readings": [_reading(readout) for readout in series.readouts()],
        "signs": [{"device": device, "colour": colour} for device, colour, _ in series.signs()],
        "mind": mind,
        "swept": [
            {"reach": sweeps.reach, "angles": _array(sweeps.angles[_rays(sweeps.angles)])} for sweeps in series.sweeps()
        ],
    }


def _item(item: Item) -> dict[str, Any]:
    """An item of a display list; what is usual is left out."""
    usual = Item([])._asdict()
    given = {name: value for name, value in item._asdict().items() if value != usual[name]}
    return given | {"points": _points(np.array(item.points))}


def _reading(readout: Readout) -> dict[str, Any]:
    return {"name": readout.device.replace("_", " "), "unit": readout.unit, "digits": readout.digits}


def _robot(robot: robots.RobotDescription) -> dict[str, Any]:
    """What the page needs to draw the robot (m, rad)."""
    return {
        "radius": robot.body.radius_m,
        "items": [_item(item) for item in scene.robot_items(robot)],
        "ghost": [_item(item) for item in scene.ghost_items(robot)],
        "pivot": scene.pivot(robot),
    }


# ---- what a stretch of time adds -------------------------------------------------------------------------------------


def moving_data(moving: Sequence[Moving]) -> list[dict[str, Any]]:
    """Where the moving shapes were; `time` on the clock of the truth (s)."""
    return [{"time": _array(one.time), "pose": [_array(row) for row in (one.x, one.y, one.heading)]} for one in moving]


def rows_data(
    result: Run, view: scene.View, ticks: Columns, record: Record, *, sweeps_room: int | None = None
) -> dict[str, Any]:
    """What a robot did in a stretch of time, which the page appends to what it has.

    Args:
        result: of the robot.
        view: what it did.
        ticks: all of that stretch, of which the view may have a few.
        record: has the rows of that stretch.
        sweeps_room: how many numbers of two bytes the sweeps of each sensor may take; None: all of them.
    """
    series = view.columns
    deeds = [(time_s, "intervention", words) for time_s, words in happenings(record)]
    happened = sorted(events(ticks, result.whiskers) + deeds, key=itemgetter(0))
    edges = pins(record.block("pins"), result.robot, result.clock_offset)
    return {
        "time": _array(series.time),
        "path": _pose(view.path),
        "estimate": None if view.estimate is None else _pose(view.estimate),
        "turret": _array(view.turret),
        "left": _array(series.signals[0]),
        "right": _array(series.signals[1]),
        "state": _small(states(series)),
        "contact": _small(np.zeros(len(series)) if series.contact is None else series.contact),
        "signs": [_small(values) for _, _, values in series.signs()],
        "readings": [{"values": _array(one.values), "ages": _array(one.ages)} for one in series.readouts()],
        "shown": _shown(view.shown),
        "layers": [_layer(layer, view.start) for layer in view.layers],
        "swept": [_swept(one, sweeps_room) for one in view.swept],
        "mind": None if view.brain is None else _mind(view.brain),
        "events": [[round(time, 4), kind, text] for time, kind, text in happened[:EVENTS_AT_MOST]],
        "printed": _printed(record) if result.program else [],
        "pins": [_pin(name, time, level) for name, (time, level) in edges.items()],
    }


def _printed(record: Record) -> list[list[Any]]:
    """Time (s) and text of the last lines that a program printed."""
    lines: deque[list[Any]] = deque(maxlen=LINES_AT_MOST)
    monitor = Monitor(lambda time_s, line: lines.append([round(time_s, 4), line]))
    for time_s, data in record.each_row("to_host"):
        monitor.wait(time_s)
        monitor.hear(time_s, data)
    monitor.close()
    return list(lines)


def states(series: Columns) -> NDArray[np.intp]:
    """What drives the motors at each tick: 0 the brain, 1 nothing, 2 nothing (dead-man), 3 the board's own brain."""
    flags = series.status
    is_on, dead_man, fallback = Status.MOTORS_ENABLED, Status.DEAD_MAN, Status.FALLBACK
    return np.select([(flags & fallback) > 0, (flags & dead_man) > 0, (flags & is_on) == 0], [3, 2, 1], 0)


def events(series: Columns, whiskers: Sequence[str]) -> list[Event]:
    """What happened to a robot, by its ticks that are new: contacts, touches, faults, lost frames, restarts of the
    board; oldest first."""
    time = series.time
    if not len(time):
        return []
    touched = () if series.contact is None else touch_indices(time, series.contact)
    found = [(index, "contact", "true contact") for index in touched]
    for name in whiskers:
        pressed = series.flag(name, "pressed")
        found += [(index, "touch", f"{name.replace('_', ' ')} pressed") for index in _rises(pressed)]
    for flag, text in FAULTS.items():
        found += [(index, "fault", text) for index in _rises((series.status & int(flag)) != 0)]
    steps = np.diff(time)
    usual = float(np.median(steps)) if len(steps) else 0.0
    for index in np.flatnonzero(steps > GAP * usual) + 1:
        lost = round(float(steps[index - 1]) / usual) - 1 if usual else 0
        found.append((index, "lost", f"{lost} {'frame' if lost == 1 else 'frames'} of telemetry lost"))
    ticks = np.diff(series.raw["tick"].astype(np.uint32)).astype(np.int32)
    found += [(index + 1, "reset", "the board restarted") for index in np.flatnonzero(ticks < 0)]
    return [(float(time[index]), kind, text) for index, kind, text in sorted(found) if index >= series.first]


def pins(block: Block, robot: robots.RobotDescription, begin: float) -> dict[str, tuple[Floats, NDArray[np.uint8]]]:
    """Output edges of a record, rows of its stream "pins", by the name of the pin: on the run's clock, which begins at
    `begin` (s)."""
    times, rows = block.times, block.table(np.dtype([("pin", "u1"), ("level", "u1")]))
    names, found = named_pins(robot), {}
    for pin in np.unique(rows["pin"][times > begin]).tolist():  # pins that do something
        own = rows["pin"] == pin
        found[names[pin]] = times[own] - begin, rows["level"][own]
    return found


def _rises(flags: Bools) -> NDArray[np.intp]:
    """Where a flag goes up; not where it is up from the start."""
    return np.flatnonzero(flags[1:] & ~flags[:-1]) + 1


def _shown(shown: Shown) -> dict[str, Any]:
    """What the brain showed: numbers as arrays, texts as indices into the list of all their words."""
    texts = []
    for name, values in shown.texts.items():
        words = sorted(set(values))
        place = {word: index for index, word in enumerate(words)}
        texts.append({"name": name, "words": words, "index": [place[value] for value in values]})
    numbers = [{"name": name, "values": _array(values)} for name, values in shown.numbers.items()]
    return {"time": _array(shown.time), "numbers": numbers, "texts": texts}


def _layer(layer: Layer, start: tuple[float, float, float]) -> dict[str, Any]:
    """What the brain sketched: arrays of points are x and y in turn (m); `origin` null: where the robot is."""
    origins = {"robot": None, "start": start, "arena": (0.0, 0.0, 0.0)}
    sketches = []
    for sketch in layer.sketches:
        whole = msgspec.to_builtins(sketch)
        kept = {key: whole[key] for key in ("lines", "points", "grid")}
        sketches.append(kept | {"origin": origins[sketch.frame]})
    return {"name": layer.name, "time": _array(layer.time), "sketches": sketches}


def _rays(angles: Floats) -> NDArray[np.intp]:
    """Which of a sweep's rays the page has; the outermost are among them."""
    return np.linspace(0, len(angles) - 1, min(len(angles), RAYS_AT_MOST)).round().astype(np.intp)


POSE_NUMBERS = 8  # as many numbers of two bytes as time and place of a sweep take


def _swept(swept: scene.Swept, room: int | None) -> dict[str, Any]:
    """The sweeps of one sensor; every n-th, where all have no room."""
    rays, stride = _rays(swept.sweeps.angles), 1
    if room is not None:
        stride = max(1, math.ceil(len(swept.time) / max(1, room // (len(rays) + POSE_NUMBERS))))
    which = np.arange(0, len(swept.time), stride)
    shares = np.minimum(swept.distances(which, rays) / swept.sweeps.reach, 1.0)
    return {
        "time": _array(swept.time[which]),
        "pose": _pose(swept.pose.part(which)),
        "distances": _base64((shares * WHOLE).round().astype("<u2")),
    }


def _mind(record: BrainRecord) -> dict[str, Any]:
    """Of each step its utilities and the active behavior; the switches."""
    names = record.names
    return {
        "time": _array(record.time),
        "motor": _small(record.motor),
        "behaviors": [_array(record.utility_of(name)) for name in names.behaviors],
        "cognitive": [_array(record.utility_of(name)) for name in names.cognitive[:COGNITIVE_AT_MOST]],
        "switches": [
            [round(switch.time, 3), switch.on, switch.reason]
            for switch in record.switches
            if switch.on in names.behaviors
        ],
    }


def _pin(name: str, time: Floats, level: NDArray[np.uint8]) -> dict[str, Any]:
    return {
        "name": name,
        "time": _base64(time[:EDGES_AT_MOST].astype("<f8")),
        "level": _small(level[:EDGES_AT_MOST]),
    }


def _pose(pose: Pose) -> list[str]:
    return [_array(values) for values in (pose.x, pose.y, pose.heading)]


def _points(points: Floats) -> list[list[float]]:
    rounded: list[list[float]] = np.round(points, 4).tolist()
    return rounded


def _array(values: Floats) -> str:
    with np.errstate(over="ignore"):  # what a brain shows may be beyond float32: infinite on the page
        return _base64(values.astype("<f4"))


def _small(values: NDArray[Any]) -> str:
    return _base64(values.astype(np.uint8))


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")
