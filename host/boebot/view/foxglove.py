"""foxglove.mcap: a run in the schemas of Foxglove (foxglove.dev), which draws and plots it without set-up.

topic             what is in it
/tf               frames in `world`: `robot` by its true pose, else by odometry; `odometry`, where the odometry thinks
                  that it is, laid on the true start; `mover-1` and so on, the shapes that move
/scene            arena, moving shapes and robots
/path, /odometry_path   all poses at once, thinned
/laser            each sweep of a laser range finder
/ping and so on   numbers of a device, as in run.csv; /board: numbers of the board, or of a robot without one
/shown            numbers that the brain shows
/command          what the brain asked for: kind (0 stop, 1 signal, 2 speed), left, right
/log              events of the board, switches of a brain, notices, how the run ended

Times are the run's, from 0 on. Of several robots, topics and frames begin with robot-1, robot-2 and so on, but for
`world`, movers, /tf, /scene and /log. It is made part by part: memory does not grow with the run.
"""

from __future__ import annotations

import heapq
import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf import message_factory
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.timestamp_pb2 import Timestamp

from boebot.arenas.floor_plan import moving_solids
from boebot.devices.laser import Laser
from boebot.errors import brief
from boebot.record.brain_record import each_switch, names_in, shown_in
from boebot.record.columns import Columns, columns, events
from boebot.showing import VALUES
from boebot.view import foxglove_scene, scene, style

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from boebot.record.run import Run
    from boebot.record.truth import Floats, Pose

WORLD = "world"
FIELD = re.compile(r"\W|^(?=\d)", re.ASCII)  # what no name of a Protobuf field has


Entry = tuple[float, str, Any]
"""Time (s), topic and message, on its way into the file."""
_TIME = itemgetter(0)


def write(results: Sequence[Run], path: Path) -> None:
    """Writes the robots of one run."""
    prefixes = [""] if len(results) == 1 else [f"robot-{number}/" for number in range(1, len(results) + 1)]
    colours = [style.colour(number) for number in range(1, len(results) + 1)]
    streams = [_scene(results, prefixes, colours), _movers(results[0])]
    for result, prefix in zip(results, prefixes, strict=True):
        streams += [_ticks(result, prefix), _log(result, prefix)]
    with path.open("wb") as file:
        _write(heapq.merge(*streams, key=_TIME), file)


def _write(entries: Iterable[Entry], file: Any) -> None:
    """Messages, oldest first: each topic is a channel, and says once what its messages are made of."""
    from mcap.writer import Writer

    out: Any = Writer(file)
    out.start(library="boebot")
    channels: dict[str, int] = {}
    schemas: dict[tuple[str, bytes], int] = {}
    for time_s, topic, message in entries:
        if topic not in channels:
            name, files = message.DESCRIPTOR.full_name, _files_of(message.DESCRIPTOR.file)
            if (name, files) not in schemas:
                schemas[name, files] = out.register_schema(name, "protobuf", files)
            channels[topic] = out.register_channel(topic, "protobuf", schemas[name, files])
        time_ns = _ns(time_s)
        out.add_message(channels[topic], time_ns, message.SerializeToString(), time_ns)
    out.finish()


def _files_of(file: Any) -> bytes:
    """A descriptor's file and those that it needs, before it: a FileDescriptorSet."""
    found: dict[str, FileDescriptorProto] = {}

    def add(one: Any) -> None:
        for needed in one.dependencies:
            add(needed)
        if one.name not in found:
            found[one.name] = FileDescriptorProto()
            one.CopyToProto(found[one.name])

    add(file)
    return FileDescriptorSet(file=found.values()).SerializeToString()


def _ns(time_s: float) -> int:
    return max(0, round(time_s * 1e9))


def _stamp(time_s: float) -> Timestamp:
    seconds, nanoseconds = divmod(_ns(time_s), 10**9)
    return Timestamp(seconds=seconds, nanos=nanoseconds)


def _transform(time_s: float, frame: str, x: float, y: float, heading: float) -> FrameTransform:
    return FrameTransform(
        timestamp=_stamp(time_s),
        parent_frame_id=WORLD,
        child_frame_id=frame,
        translation=Vector3(x=x, y=y),
        rotation=foxglove_scene.rotation(heading),
    )


# ---- what stands there -----------------------------------------------------------------------------------------------


def _scene(results: Sequence[Run], prefixes: Sequence[str], colours: Sequence[str]) -> Iterator[Entry]:
    """Arena, movers, robots and whole paths: once, at the beginning."""
    entities = []
    if results[0].has_truth:
        assert results[0].world is not None
        entities.append(foxglove_scene.items(scene.arena_items(results[0].plan), "arena", WORLD))
        for number, solid in enumerate(moving_solids(results[0].world)):
            entities.append(foxglove_scene.items([scene.moving_item(solid)], _mover(number), _mover(number)))
    for result, prefix, colour in zip(results, prefixes, colours, strict=True):
        frame = f"{prefix}robot"
        entities.append(foxglove_scene.items(scene.robot_items(result.robot), frame, frame, colour))
        if result.overview.columns.odometry is not None:
            frame = f"{prefix}odometry"
            entities.append(foxglove_scene.items(scene.ghost_items(result.robot), frame, frame))
    yield 0.0, "/scene", SceneUpdate(entities=entities)
    for result, prefix in zip(results, prefixes, strict=True):
        few, true = result.overview, result.overview.columns.true_pose
        odometry = few.columns.odometry
        if true is None and odometry is None:  # it stays at the middle, for all that is known
            yield 0.0, "/tf", FrameTransforms(transforms=[_transform(0.0, f"{prefix}robot", 0.0, 0.0, 0.0)])
        for topic, path in (
            ("path", odometry if true is None else true),
            ("odometry_path", few.columns.placed_odometry),
        ):
            if path is not None:
                yield 0.0, f"/{prefix}{topic}", _path(path)


def _path(path: Pose) -> PosesInFrame:
    poses = zip(path.x.tolist(), path.y.tolist(), path.heading.tolist(), strict=True)
    return PosesInFrame(
        timestamp=_stamp(0.0), frame_id=WORLD, poses=[foxglove_scene.pose(x, y, heading) for x, y, heading in poses]
    )


def _mover(number: int) -> str:
    return f"mover-{number + 1}"


def _movers(result: Run) -> Iterator[Entry]:
    """Where moving shapes are, over time."""
    if not result.has_truth or not result.plan.moving:
        return
    moving, offset_s = result.plan.moving, result.clock_offset
    for index in np.flatnonzero(moving[0].time >= offset_s):
        poses = [(float(one.x[index]), float(one.y[index]), float(one.heading[index])) for one in moving]
        time_s = float(moving[0].time[index] - offset_s)
        transforms = [_transform(time_s, _mover(k), *pose) for k, pose in enumerate(poses)]
        yield time_s, "/tf", FrameTransforms(transforms=transforms)


# ---- what happens at each tick ---------------------------------------------------------------------------------------


def _ticks(result: Run, prefix: str) -> Iterator[Entry]:
    """Poses, sweeps, numbers and commands of a robot."""
    kinds: dict[str, Any] = {}
    names = names_in(result.record.each_row(VALUES))
    start: tuple[float, float, float] | None = None
    for part in columns(result):
        if start is None:
            start = (0.0, 0.0, 0.0) if part.true_pose is None else part.true_pose.at(0)
        estimate = None if part.odometry is None else part.odometry.placed(*start)
        steps = part.steps[part.steps >= part.first]
        commands = {name: part.command[name][steps] for name in ("kind", "left", "right")}
        yield from heapq.merge(
            _poses(part, estimate, prefix),
            _sweeps(result, part, prefix),
            *(
                _numbers(f"/{prefix}{name}", part.time[part.first :], table, kinds)
                for name, table in _tables(result, part, names).items()
            ),
            _numbers(f"/{prefix}command", part.time[steps], commands, kinds),
            key=_TIME,
        )


def _poses(part: Columns, estimate: Pose | None, prefix: str) -> Iterator[Entry]:
    seen = part.true_pose if part.true_pose is not None else estimate
    if seen is None:
        return
    placed = [("robot", seen)] + ([] if estimate is None else [("odometry", estimate)])
    for index, time_s in itertools.islice(enumerate(part.time.tolist()), part.first, None):
        transforms = [_transform(time_s, f"{prefix}{frame}", *path.at(index)) for frame, path in placed]
        yield time_s, "/tf", FrameTransforms(transforms=transforms)


def _sweeps(result: Run, part: Columns, prefix: str) -> Iterator[Entry]:
    """Of each laser range finder, when it was read anew."""
    for name, laser in result.robot.device.items():
        if not isinstance(laser, Laser) or not part.device_columns(name):
            continue
        distances = part.values(name)
        sampled = part.time - part.ages(name)
        is_new = np.diff(sampled, prepend=-np.inf) > scene.SAME_S
        half = laser.step_rad * (laser.rays - 1) / 2
        place = foxglove_scene.pose(*laser.position_m, laser.heading_rad, height=laser.height_m)
        for index in np.flatnonzero(is_new[part.first :]) + part.first:
            row = distances[index]
            sweep = LaserScan(
                timestamp=_stamp(sampled[index]),
                frame_id=f"{prefix}robot",
                pose=place,
                start_angle=-half,
                end_angle=half,
                ranges=np.where(row < 0, np.inf, row).tolist(),
            )
            yield part.time[index], f"/{prefix}{name}", sweep


def _tables(result: Run, part: Columns, names: Mapping[str, bool]) -> dict[str, dict[str, NDArray[Any]]]:
    """Numbers at each new tick, by their names: of each device that has no topic of another kind, of the board, and of
    what the brain shows (`names_in`)."""
    devices = {
        name: list(part.device_columns(name).values())
        for name, device in result.robot.device.items()
        if not isinstance(device, Laser)
    }
    tables = {
        name: {"_".join(filter(None, (one.name, one.unit))): one.values for one in columns}
        for name, columns in (devices | {"board": part.own_columns()}).items()
    }
    shown = shown_in(part.showing.rows(), names).at(part.time).numbers
    tables["shown"] = {
        f"{FIELD.sub('_', name)}_{place}" if FIELD.search(name) else name: values
        for place, (name, values) in enumerate(shown.items())
    }
    return {
        name: {field: values[part.first :] for field, values in table.items()}
        for name, table in tables.items()
        if table
    }


def _numbers(topic: str, time: Floats, table: dict[str, NDArray[Any]], kinds: dict[str, Any]) -> Iterator[Entry]:
    """A message for each row of these columns of equal length. `kinds`: of messages, by their topics, so far."""
    if topic not in kinds:
        kinds[topic] = _kind(topic.rpartition("/")[2], table)
    columns = (values.astype(np.float64).tolist() for values in table.values())
    for time_s, *row in zip(time.tolist(), *columns, strict=True):
        yield time_s, topic, kinds[topic](**dict(zip(table, row, strict=True)))


def _kind(name: str, fields: Iterable[str]) -> Any:
    """The class of messages `boebot.NAME`, whose fields are doubles: what Foxglove can plot over time."""
    name = "".join(letter if letter.isascii() else "_" for letter in name)  # as Protobuf's names are
    file = FileDescriptorProto(name=f"boebot/{name}.proto", package="boebot", syntax="proto3")
    message, kinds = file.message_type.add(name=name), FieldDescriptorProto
    for number, field in enumerate(fields, 1):
        message.field.add(name=field, number=number, label=kinds.LABEL_OPTIONAL, type=kinds.TYPE_DOUBLE)
    pool = DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"boebot.{name}"))


# ---- what is said ----------------------------------------------------------------------------------------------------


def _log(result: Run, prefix: str) -> Iterator[Entry]:
    """Events and switches when they happened; at the end notices, and why it ended early."""
    yield from heapq.merge(_events(result, prefix), _switches(result, prefix), key=_TIME)
    said = [(Log.WARNING, notice) for notice in result.notices]
    if result.error is not None:
        said.append((Log.ERROR, f"{brief(result.error)[0]}: {result.table()['ended']}"))
    for level, sentence in said:
        yield _line(result.run_time, level, f"{prefix}run", sentence)


def _line(time_s: float, level: Any, name: str, sentence: str) -> Entry:
    return time_s, "/log", Log(timestamp=_stamp(time_s), level=level, message=sentence, name=name)


def _events(result: Run, prefix: str) -> Iterator[Entry]:
    for time_s, event in events(result):
        yield _line(time_s, Log.INFO, f"{prefix}board", event.what())


def _switches(result: Run, prefix: str) -> Iterator[Entry]:
    for switch in each_switch(result.record):
        sentence = f"{switch.off or 'nothing'} -> {switch.on or 'nothing'}"
        yield _line(switch.time, Log.INFO, f"{prefix}brain", f"{sentence}: {switch.reason}")
