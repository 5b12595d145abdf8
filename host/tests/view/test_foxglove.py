"""foxglove.mcap, read back with mcap's own reader and the message classes of Foxglove's package."""

from __future__ import annotations

import dataclasses
import math
import struct
import sys
from collections import defaultdict
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf import message_factory
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from mcap.reader import make_reader

import boebot
from boebot.arenas.floor_plan import floor_plan
from boebot.devices.drawing import circle
from boebot.record import columns
from boebot.record.truth import Pose
from boebot.result import RunResult, TogetherResult, robots_of
from boebot.running.loop import execute
from boebot.running.tasks import Request
from boebot.view import save_for_foxglove
from command import boebot as command

CLASSES: dict[str, Any] = {
    kind.DESCRIPTOR.full_name: kind for kind in (FrameTransforms, LaserScan, Log, PosesInFrame, SceneUpdate)
}
LASER = """
[device.laser]
type = "laser_range_finder"
position_m = [0.1, 0.02]
heading_rad = 0.25
rays = 31
step_rad = 0.1
period_s = 0.1
"""

Messages = dict[str, list[tuple[float, Any]]]


def read(path: Path) -> Messages:
    """Of each topic: time (s) and message, decoded by the schema in the file."""
    found: Messages = defaultdict(list)
    decoders: dict[int, Any] = {}
    last_ns = 0
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False):
            assert schema is not None and schema.encoding == channel.message_encoding == "protobuf"
            if schema.id not in decoders:
                decoders[schema.id] = decoder(schema.name, schema.data)
            assert message.log_time >= last_ns, "times go back"
            last_ns = message.log_time
            found[channel.topic].append((message.log_time / 1e9, decoders[schema.id].FromString(message.data)))
    return found


def decoder(name: str, schema: bytes) -> Any:
    """Foxglove's own class where there is one; the schema in the file has to be the same."""
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(schema).file:
        pool.Add(file)
    described = pool.FindMessageTypeByName(name)
    if name.startswith("foxglove."):
        assert [field.name for field in described.fields] == [field.name for field in CLASSES[name].DESCRIPTOR.fields]
        return CLASSES[name]
    return message_factory.GetMessageClass(described)


def saved(result: RunResult | TogetherResult, folder: Path) -> Messages:
    folder.mkdir(exist_ok=True)
    path = save_for_foxglove([*robots_of(result).values()], folder)
    assert path == folder / "foxglove.mcap" and list(folder.iterdir()) == [path]
    return read(path)


def test_numbers_that_the_brain_shows_are_there(tmp_path: Path) -> None:
    def step(robot: boebot.Robot) -> None:
        robot.show("tenths of a second", round(robot.time * 10))
        robot.show("half", "first" if robot.time < 0.25 else "second")

    result = boebot.run(step, robot="arsim", arena="empty", seconds=0.5, period=0.1)
    shown = saved(result, tmp_path)["/shown"]
    assert [message.tenths_of_a_second_0 for _, message in shown[::10]] == [0, 1, 2, 3, 4, 4]
    assert len(shown) == result.ticks and len(shown[0][1].DESCRIPTOR.fields) == 1


def heading(rotation: Any) -> float:
    assert rotation.x == rotation.y == 0
    return 2 * math.atan2(rotation.z, rotation.w)


def transforms(messages: Messages, frame: str) -> Pose:
    each = [one for _, message in messages["/tf"] for one in message.transforms if one.child_frame_id == frame]
    assert {one.parent_frame_id for one in each} == {"world"}
    rows = [(one.translation.x, one.translation.y, heading(one.rotation)) for one in each]
    return Pose(*np.array(rows).T)


def assert_same(one: Pose, other: Pose | None, atol: float = 1e-12) -> None:
    assert other is not None and len(one.x) == len(other.x)
    for name in ("x", "y"):
        assert np.allclose(getattr(one, name), getattr(other, name), atol=atol, rtol=0), name
    assert np.allclose(np.exp(1j * one.heading), np.exp(1j * other.heading), atol=atol, rtol=0)


def numbers(messages: Messages, topic: str, field: str) -> Any:
    return np.array([getattr(message, field) for _, message in messages[topic]])


@cache
def showcase() -> RunResult:
    return boebot.run("wander", "shieldbot-charging", "showcase", seconds=6)


def test_board_is_drawn_and_plotted(tmp_path: Path) -> None:
    result = showcase()
    messages, series = saved(result, tmp_path), result.series
    assert_same(transforms(messages, "robot"), result.true_pose)
    assert_same(transforms(messages, "odometry"), result.placed_odometry)
    assert [len(messages[topic][0][1].poses) for topic in ("/path", "/odometry_path")] == [result.ticks] * 2
    assert np.allclose([time for time, _ in messages["/board"]], series.time, atol=1e-9)
    for device, name in (("ping", "distance_m"), ("whisker_left", "pressed"), ("light_left", "decay_time_s")):
        field = name.removesuffix("_m").removesuffix("_s")
        assert np.array_equal(numbers(messages, f"/{device}", name), series.number(device, field), equal_nan=True)
    assert np.array_equal(numbers(messages, "/board", "supply_v"), series.raw["supply"] / 1000)
    assert [message.left for _, message in messages["/command"]] == [step[2] for step in result.record.steps]
    assert [time for time, _ in messages["/command"]] == pytest.approx(
        [series.time[step[0]] for step in result.record.steps]
    )


def test_scene_has_arena_movers_and_robot(tmp_path: Path) -> None:
    result = showcase()
    messages, plan = saved(result, tmp_path), result.plan
    ((time_s, scene),) = messages["/scene"]
    entities = {entity.id: entity for entity in scene.entities}
    movers = [f"mover-{number}" for number in range(1, len(plan.moving) + 1)]
    assert time_s == 0 and list(entities) == ["arena", *movers, "robot", "odometry"] and movers
    assert all(entity.frame_locked for entity in scene.entities)
    corners = [[[point.x, point.y] for point in line.points] for line in entities["arena"].lines]
    for solid in plan.solids:
        disc = np.array(circle(solid.points[0].tolist(), solid.radius))
        assert (disc if solid.kind == "disc" else solid.points).tolist() in corners, solid.name
    for mover, moving in zip(movers, plan.moving, strict=True):
        each = [
            (time, one)
            for time, message in messages["/tf"]
            for one in message.transforms
            if one.child_frame_id == mover
        ]
        assert len(each) > 100
        for time, one in each[::20]:
            x, y, angle = moving.pose(time + result.clock_offset)
            assert (one.translation.x, one.translation.y) == pytest.approx((x, y), abs=2e-4)
            assert math.cos(heading(one.rotation) - angle) == pytest.approx(1, abs=1e-6)


def test_movers_that_were_put_elsewhere(tmp_path: Path) -> None:
    """The first one half a metre to the right of its way from 0.5 s of the world's clock on, between two rows."""
    result = boebot.run("wander", arena="showcase", seconds=1)
    result.record.append("shifts", 0.5123, struct.pack("<4d", 0, 0.5, 0.0, 0.25))
    assert result.world is not None
    way = floor_plan(result.world, 0.0, 2.0).moving[0]
    moved = 0
    for time, message in saved(result, tmp_path)["/tf"]:
        for one in message.transforms:
            if one.child_frame_id == "mover-1" and abs(time + result.clock_offset - 0.5123) > 1e-5:
                x, y, angle = way.pose(time + result.clock_offset)
                off = time + result.clock_offset > 0.5123
                assert (one.translation.x, one.translation.y) == pytest.approx((x + 0.5 * off, y), abs=2e-4)
                assert math.cos(heading(one.rotation) - angle - 0.25 * off) == pytest.approx(1, abs=1e-6)
                moved += off
    assert moved > 5


def test_windows_of_any_size_give_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    at_once = saved(dataclasses.replace(showcase()), tmp_path / "at_once")
    monkeypatch.setattr(columns, "TICKS", 70)
    by_windows = saved(dataclasses.replace(showcase()), tmp_path / "by_windows")
    assert {topic: len(each) for topic, each in at_once.items()} == {
        topic: len(each) for topic, each in by_windows.items()
    }
    assert_same(transforms(by_windows, "odometry"), transforms(at_once, "odometry"), atol=1e-9)
    for topic in ("/ping", "/board", "/command", "/log", "/light_left"):
        assert [str(row) for row in by_windows[topic]] == [str(row) for row in at_once[topic]], topic


def test_sweeps_of_a_laser_are_drawn(tmp_path: Path) -> None:
    robot = tmp_path / "scanner.toml"
    bundled = Path(boebot.__file__).parents[2] / "protocol" / "robots" / "arsim.toml"
    robot.write_text(bundled.read_text(encoding="utf-8") + LASER, encoding="utf-8")
    result = boebot.run("wander", robot, seconds=3)
    messages, series = saved(result, tmp_path / "out"), result.series
    sampled = series.time - series.ages("laser")
    new = np.flatnonzero(np.diff(sampled, prepend=-1) > 1e-6)
    assert len(messages["/laser"]) == len(new) and 25 < len(new) < len(series)
    for index, (time_s, sweep) in zip(new, messages["/laser"], strict=True):
        expected = series.values("laser")[index]
        assert list(sweep.ranges) == np.where(expected < 0, np.inf, expected).tolist()
        assert time_s == pytest.approx(series.time[index])
        assert sweep.timestamp.ToNanoseconds() / 1e9 == pytest.approx(sampled[index])
    assert (sweep.start_angle, sweep.end_angle) == pytest.approx((-1.5, 1.5)) and sweep.frame_id == "robot"
    place = sweep.pose.position
    assert (place.x, place.y, place.z) == (0.1, 0.02, 0.1) and heading(sweep.pose.orientation) == pytest.approx(0.25)
    assert "/infrared_left" in messages and "signal_left" in {
        field.name for field in messages["/board"][0][1].DESCRIPTOR.fields
    }


def test_log_has_events_switches_notices_and_the_end(tmp_path: Path) -> None:
    """A robot that drives into the wall, and a brain that fails there."""

    def step(robot: boebot.Robot) -> None:
        if robot.whisker_left.pressed and robot.whisker_right.pressed:
            raise ValueError("ouch")
        robot.drive(0.8, 0.8)

    result = execute(Request.single(step, "shieldbot", seconds=30))
    lines = saved(result, tmp_path)["/log"]
    touch_s = result.series.time[np.flatnonzero(result.series.flag("whisker_left", "pressed"))[0]]
    times = [time for time, line in lines if line.message.startswith("whiskers pressed: left")]
    assert times[0] == pytest.approx(touch_s, abs=0.021)
    last_s, last = lines[-1]
    assert last.level == Log.ERROR and "ouch" in last.message and last_s == pytest.approx(result.run_time)
    assert [line.message for _, line in lines if line.level == Log.WARNING] == result.notices


def test_log_has_a_brains_switches(tmp_path: Path) -> None:
    result = boebot.run("clearway", seconds=10)
    assert result.brain_record is not None
    said = [(time, line.message) for time, line in saved(result, tmp_path)["/log"] if line.name == "brain"]
    assert [time for time, _ in said] == pytest.approx([switch.time for switch in result.brain_record.switches])
    assert said[0][1].startswith("nothing -> wander: ") and len(said) > 2


def test_several_robots_share_a_world(tmp_path: Path) -> None:
    members = [boebot.Member(brain="wander", robot=name) for name in ("shieldbot", "arsim")]
    result = boebot.run_together(members, "showcase", seconds=3)
    messages = saved(result, tmp_path)
    for number, robot in enumerate(result.robots, 1):
        assert_same(transforms(messages, f"robot-{number}/robot"), robot.true_pose)
        assert_same(transforms(messages, f"robot-{number}/odometry"), robot.placed_odometry)
        assert len(messages[f"/robot-{number}/command"]) == robot.steps
    ids = [entity.id for entity in messages["/scene"][0][1].entities]
    assert [name for name in ids if name.startswith("robot")] == [
        f"robot-{number}/{what}" for number in (1, 2) for what in ("robot", "odometry")
    ]


def test_without_a_simulator_it_goes_by_odometry(tmp_path: Path) -> None:
    """A run whose truth nobody knows, as that of a real board."""
    result = dataclasses.replace(showcase(), world=None)
    messages = saved(result, tmp_path)
    assert_same(transforms(messages, "robot"), result.odometry)
    assert [entity.id for entity in messages["/scene"][0][1].entities] == ["robot", "odometry"]
    assert "/odometry_path" not in messages
    blind = boebot.run("wander", "boebot", seconds=1)
    messages = saved(dataclasses.replace(blind, world=None), tmp_path)
    assert len(transforms(messages, "robot").x) == 1


def test_command_writes_it_and_a_new_run_replaces_it(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "run"
    boebot.run("wander", seconds=1, out=folder)
    code, out, err = command(capsys, "report", str(folder), "--as", "foxglove")
    assert (code, err) == (0, "") and "foxglove.mcap" in out and (folder / "foxglove.mcap").is_file()
    boebot.run("wander", seconds=1, out=folder)
    assert not (folder / "foxglove.mcap").exists()
    monkeypatch.delattr("boebot.view.foxglove")
    for name in [name for name in sys.modules if name.startswith(("foxglove_", "boebot.view.foxglove"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "foxglove_schemas_protobuf", None)
    code, out, err = command(capsys, "report", str(folder), "--as", "foxglove")
    assert code != 0 and "pip install 'boebot[foxglove]'" in " ".join(err.split()) and "Traceback" not in err
    assert not (folder / "foxglove.mcap").exists()
