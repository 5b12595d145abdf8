"""Several robots in one run: they bump each other and go on, their order does not matter, one's error ends the run."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Sequence
from pathlib import Path

import pytest

import boebot
from boebot import Member
from boebot.arenas import load_arena
from boebot.boards import BoardRequest, World, open_world
from boebot.description.robots import load_robot
from boebot.errors import ArenaError, BoardError, BoebotError, BrainError
from boebot.link import frame
from boebot.link.messages import Hello, Stopped
from boebot.result import RunResult
from boebot.robot import Robot
from boebot.running import loop
from boebot.running.loop import StoppedError, execute
from boebot.running.tasks import Request
from boebot.view import style
from sim_bridge.sessions.places import places_of
from sim_bridge.sessions.session import SimSession
from sim_bridge.sessions.world import SimWorld

pytestmark = pytest.mark.unsanitized

SECONDS = 8.0


def ahead(robot: Robot) -> None:
    robot.drive(0.8, 0.8)


def stand(robot: Robot) -> None:
    robot.drive(0.0, 0.0)


def digest(result: RunResult) -> str:
    """Of all that the run of one robot consists of: every byte with its time, every command, the true path."""
    heap = hashlib.sha256()
    for stamp, data in (*result.record.rows("to_board"), *result.record.rows("to_host")):
        heap.update(repr((stamp, data)).encode())
    heap.update(repr(result.record.steps).encode())
    pose = result.true_pose
    assert pose is not None
    for column in (pose.x, pose.y, pose.heading):
        heap.update(column.tobytes())
    return heap.hexdigest()


@pytest.mark.parametrize("on", ["native", "avr"])
def test_far_robot_changes_no_bit_of_the_first_ones_run(on: str) -> None:
    """Nor does it matter whether that one runs by itself, through `boebot.run`."""
    seconds = SECONDS if on == "native" else 2.0
    alone = digest(boebot.run("wander", arena="empty", on=on, seconds=seconds, seed=4))
    two = boebot.run_together(
        [Member(), Member(brain=ahead, pose=(50.0, 0.3, 1.0), period=0.03)], "empty", seconds, on, seed=4
    )
    assert digest(two.robots[0]) == alone
    assert digest(two.robots[1]) != alone


def test_near_robot_does_change_it() -> None:
    def first(x: float) -> str:
        members = [Member(), Member(brain=stand, pose=(x, 0.0, math.pi))]
        return digest(boebot.run_together(members, "empty", SECONDS, seed=4).robots[0])

    assert first(0.4) != first(50.0)


def test_result_does_not_depend_on_which_other_far_robots_there_are() -> None:
    """Each keeps its number; the brains and periods of the others change how often the clock stops for them."""

    def second(*others: Member) -> str:
        before, *after = others
        members = [before, Member(pose=(0.0, 0.0, 0.0), seed=9), *after]
        return digest(boebot.run_together(members, "empty", 4.0).robots[1])

    outcome = second(Member(pose=(50.0, 0.0, 0.0)))
    assert outcome == second(Member(brain=ahead, pose=(-60.0, 5.0, 2.0), period=0.01))
    assert outcome == second(Member(pose=(0.0, 70.0, 0.0), period=0.07), Member(brain=stand, pose=(90.0, 0.0, 0.0)))


def test_two_that_drive_head_on_bump_and_go_on() -> None:
    """Wander in `room`: they meet nose to nose; both touch, both get away from each other again."""
    x, y, _ = load_arena("room").start
    members = [Member(pose=(x, y, 0.0)), Member(pose=(x + 0.2, y + 0.01, math.pi))]

    def blind(robot: Robot) -> None:  # straight on into each other, then as wander does
        if robot.time < 1.5:
            robot.drive(1.0, 1.0)
        else:
            wander.step(robot)

    from boebot.brains import load_brain

    wander = load_brain("wander")
    one = boebot.run_together([members[0], Member(brain=blind, pose=members[1].pose)], "room", 20.0)
    assert one.error is None
    first, second = one.robots
    assert (first.true_contacts or 0) >= 1 and (second.true_contacts or 0) >= 1
    assert first.true_pose is not None and second.true_pose is not None
    count = min(first.record.ticks, second.record.ticks)
    apart = [
        math.hypot(a - c, b - d)
        for a, b, c, d in zip(
            first.true_pose.x[:count], first.true_pose.y[:count], second.true_pose.x[:count],
            second.true_pose.y[:count], strict=True,
        )
    ]  # fmt: skip
    touching = 2 * load_robot("shieldbot").body.radius_m
    assert min(apart) > touching - 0.002, "they do not sink into each other"
    assert min(apart) < touching + 0.005
    assert max(apart) > touching + 0.2
    for robot in one.robots:
        assert (robot.true_distance or 0.0) > 0.8
        assert robot.run_time == pytest.approx(20.0)
        assert (
            robot.late_steps,
            robot.resets,
            robot.sessions_lost,
            robot.lost_frames,
            robot.overview.dead_man_stops,
        ) == (0,) * 5


def test_board_that_is_reset_in_mid_run_is_opened_again_and_nobody_else_notices(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    worlds: list[SimWorld] = []

    def opened(url: str, requests: Sequence[BoardRequest]) -> World:
        world = open_world(url, requests)
        assert isinstance(world, SimWorld)
        worlds.append(world)
        return world

    def unlucky(robot: Robot) -> None:
        robot.drive(0.6, 0.6)
        if robot.time == 1.0:
            session = worlds[-1].sessions[1]
            assert isinstance(session, SimSession)
            session.board.reset("external")

    monkeypatch.setattr(loop, "open_world", opened)
    far = (50.0, 0.0, 0.0)
    calm, troubled = (
        boebot.run_together([Member(), Member(brain=brain, pose=far)], "empty", 4.0) for brain in (ahead, unlucky)
    )
    assert digest(calm.robots[0]) == digest(troubled.robots[0])
    first, second = troubled.robots
    assert (first.resets, first.sessions_lost) == (0, 0)
    assert (second.resets, second.sessions_lost) == (1, 1)
    assert second.run_time == pytest.approx(4.0, abs=0.011) and (second.true_distance or 0.0) > 0.2


def test_same_run_twice_is_the_same() -> None:
    def outcome() -> list[str]:
        return [digest(robot) for robot in boebot.run_together([Member()] * 3, "room", 5.0, seed=2).robots]

    first = outcome()
    assert first == outcome()
    assert len(set(first)) == 3


def test_robots_of_different_kinds_and_periods_share_a_run() -> None:
    steps = {"fast": 0, "slow": 0}

    def counter(name: str) -> object:
        def step(robot: Robot) -> None:
            steps[name] += 1

        return step

    members = [
        Member(brain=counter("fast"), period=0.01),
        Member(brain=counter("slow"), robot="shieldbot-quad", period=0.5),
    ]
    result = boebot.run_together(members, "room", 3.0)
    assert steps == {"fast": 300, "slow": 6}
    assert [robot.robot.name for robot in result.robots] == ["shieldbot", "shieldbot-quad"]


# ---- ends ------------------------------------------------------------------------------------------------------------


def fails(robot: Robot) -> None:
    robot.drive(1.0, 1.0)
    if robot.time > 1.0:
        raise RuntimeError("no more")


def stopped(result: RunResult) -> bool:
    """Its board has confirmed a stop."""
    received = b"".join(data for _, data in result.record.rows("to_host"))
    hellos = [payload for number, _, payload in frame.Decoder(frame.NO_SESSION).feed(received) if number == Hello.ID]
    session = next(hello.session for hello in map(Hello.unpack, hellos) if hello.session)
    return Stopped.ID in [number for number, _, _ in frame.Decoder(session).feed(received)]


def test_error_in_one_brain_ends_the_run_and_names_the_robot() -> None:
    result = execute(
        Request(members=[Member(brain=ahead), Member(brain=fails), Member(brain=ahead)], arena="empty", seconds=30.0)
    )
    assert isinstance(result.error, BrainError)
    assert str(result.error).startswith("robot 2: ") and "RuntimeError: no more" in str(result.error)
    first, second, third = result.robots
    assert isinstance(first.error, StoppedError) and isinstance(third.error, StoppedError)
    assert isinstance(second.error, BrainError)
    for robot in result.robots:
        assert 0.9 < robot.run_time < 1.2
        assert stopped(robot)
    with pytest.raises(BrainError, match="robot 2: "):
        boebot.run_together([Member(brain=ahead), Member(brain=fails)], "empty", 30.0)


def test_interrupt_in_a_brain_stops_all() -> None:
    def interrupts(robot: Robot) -> None:
        robot.drive(1.0, 1.0)
        if robot.time > 0.5:
            raise KeyboardInterrupt

    result = execute(Request(members=[Member(brain=ahead), Member(brain=interrupts)], arena="empty", seconds=30.0))
    assert isinstance(result.error, KeyboardInterrupt)
    assert all(isinstance(robot.error, KeyboardInterrupt) and stopped(robot) for robot in result.robots)


def test_board_that_cannot_be_opened_is_named(tmp_path: Path) -> None:
    brain = tmp_path / "needs.py"
    brain.write_text("NEEDS = ['laser']\n\ndef step(robot):\n    pass\n")
    with pytest.raises(BrainError, match=r"^robot 2: brain .* needs laser, which robot 'shieldbot' does not have"):
        boebot.run_together([Member(), Member(brain=str(brain))])


@pytest.mark.parametrize(
    ("members", "wishes", "kind", "sentence"),
    [
        ([], {}, BoebotError, "there is no robot to run"),
        ([Member(), Member(brain="wonder")], {}, BrainError, "robot 2: there is no brain 'wonder'"),
        ([Member(robot="arsim")] * 2, {"on": "native"}, BoardError, "robot 'arsim' has no board: it cannot run on"),
        ([Member(robot="arsim"), Member()], {"on": "direct"}, BoardError, "robot 'shieldbot' is driven by its board"),
        ([Member(), Member()], {"on": "/dev/ttyACM0"}, BoardError, "run each robot by itself there"),
        ([Member(), Member()], {"on": "toaster"}, BoardError, "there is no board 'toaster'"),
        ([Member()] * 65, {"arena": "empty"}, BoardError, "65 robots are too many; expected at most 64"),
        ([Member(pose=(0, 0, 0)), Member(pose=(0.1, 0, 0))], {"arena": "empty"}, ArenaError, "robots 1 and 2 overlap"),
        ([Member(pose=(9, 9, 0)), Member()], {"arena": "room"}, ArenaError, "robot 1 cannot start at x = 9 m, y = 9 m"),
        ([Member(pose=(math.nan, 0, 0)), Member()], {"arena": "empty"}, ArenaError, "robot 1 cannot start at nan"),
        ([Member(pose=(1, 2))], {}, BoebotError, "expected (x in m, y in m, heading in rad)"),  # type: ignore[arg-type]
        ([Member(), "wander"], {}, BoebotError, "expected a list of boebot.Member"),
        ([Member()], {"seconds": 0.0}, BoebotError, "a run cannot last 0 s"),
    ],
)
def test_mistakes_are_told_in_a_sentence(
    members: list[Member], wishes: dict[str, object], kind: type[BoebotError], sentence: str
) -> None:
    with pytest.raises(kind, match=re.escape(sentence)) as caught:
        boebot.run_together(members, **wishes)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


# ---- places ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["room", "arsim", "maze", "office", "empty", "showcase"])
def test_places_are_free_apart_and_always_the_same(name: str) -> None:
    arena, robot = load_arena(name), load_robot("shieldbot")
    requests = [BoardRequest(robot=robot) for _ in range(6)]
    places = places_of(arena, requests)
    assert places == places_of(arena, requests)
    assert places[0] == arena.start
    radius = robot.body.radius_m
    for index, (x, y, _) in enumerate(places):
        assert arena.is_free(x, y, radius)
        assert all(math.hypot(x - u, y - v) >= 2 * radius + 0.019 for u, v, _ in places[:index])


def test_places_given_are_kept_and_others_keep_off() -> None:
    arena, robot = load_arena("empty"), load_robot("shieldbot")
    given = (*arena.start[:2], 1.0)
    places = places_of(arena, [BoardRequest(robot=robot), BoardRequest(robot=robot, pose=given)])
    assert places[1] == given
    assert math.hypot(places[0][0] - given[0], places[0][1] - given[1]) >= 2 * robot.body.radius_m + 0.3


def test_no_place_left_is_told(tmp_path: Path) -> None:
    box = tmp_path / "box.toml"
    box.write_text(
        'name = "box"\n[start]\nx_m = 0.2\ny_m = 0.2\nheading_rad = 0.0\n'
        "[[outline]]\ncorners_m = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.4], [0.0, 0.4]]\n"
    )
    with pytest.raises(ArenaError, match=r"^arena box has no free place for robot [3-9]; expected fewer robots, or"):
        boebot.run_together([Member()] * 9, box)


# ---- files -----------------------------------------------------------------------------------------------------------


def test_files_show_all_robots(tmp_path: Path) -> None:
    result = boebot.run_together([Member(), Member(brain=ahead)], "room", 3.0, out=tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"record.mcap", "run.png", "replay.html", "robot-1", "robot-2"}
    assert [path.name for path in (tmp_path / "robot-2").iterdir()] == ["summary.json"]
    page = re.search(r"const page = (\{.*\});\n", (tmp_path / "replay.html").read_text())
    assert page
    runs = json.loads(page[1].replace("<\\/", "</"))["runs"]
    assert [run["brain"] for run in runs] == ["wander", "ahead"]
    assert [run["begin"] for run in runs] == [robot.clock_offset for robot in result.robots]
    import matplotlib.image
    import numpy as np

    picture = (matplotlib.image.imread(tmp_path / "run.png")[:, :, :3] * 255).round().astype(int)
    for number in (1, 2):
        wanted = [int(style.colour(number)[i : i + 2], 16) for i in (1, 3, 5)]
        assert np.any(np.abs(picture - wanted).sum(axis=2) < 12), f"robot {number} is in the picture"
