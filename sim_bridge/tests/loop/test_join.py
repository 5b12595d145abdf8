"""Several robots in one run: they see, feel and bump each other, and their order does not matter."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pytest

from boebot.arenas import Arena, ArenaDescription, Moving, Polygon, Waypoint
from boebot.errors import ArenaError, BoardError
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.sim import NEVER, Sim
from sim_bridge.tests.simulated import MS, US, Scripted, add_scripted, arena_of, scripts, square

LED, RECEIVER, PING, LEFT_WHISKER = 9, 10, 8, 5


def sim_of(**wishes: Any) -> Sim:
    return Sim(arena_of(outline=square(0, 0, 6)), noise=wishes.pop("noise", False), **wishes)


def drive(robot: Scripted, seconds: float, left: float, right: float) -> None:
    robot.pulses(seconds, {13: left, 12: right})


def run_in_order(order: tuple[int, ...], noise: bool = True) -> tuple[int, list[Any]]:
    """Three robots that cross each other's way, added in that order; the state's hash and what each board received."""
    sim = sim_of(seed=5, noise=noise)
    poses = {0: (0.0, 0.0, 0.0), 3: (0.5, 0.02, math.pi), 7: (0.2, 0.5, -1.2)}
    robots = {number: add_scripted(sim, pose=poses[number], number=number) for number in order}
    for number, robot in robots.items():
        drive(robot, 2.0, 1700 - 10 * number, 1310 + 5 * number)
    sim.run(2 * CLOCK_HZ)
    return sim.hash(), [[robots[number].inputs(pin) for pin in range(20)] for number in sorted(robots)]


def test_order_of_adding_does_not_matter() -> None:
    outcomes = [run_in_order(order) for order in itertools.permutations((0, 3, 7))]
    assert all(outcome == outcomes[0] for outcome in outcomes)
    assert outcomes[0] != run_in_order((0, 3, 7), noise=False)


def test_robots_far_apart_do_not_disturb_each_other() -> None:
    """The first one's bits are the same as alone; another number is another robot."""

    def run(count: int) -> list[tuple[float, ...]]:
        sim = sim_of(seed=5, noise=True)
        scripts = [add_scripted(sim, pose=(2.0 * number - 1, 0, 0.3)) for number in range(count)]
        for script in scripts:
            drive(script, 1.0, 1650, 1400)
        sim.run(CLOCK_HZ)
        bodies = [script.robot.body() for script in scripts]
        return [(b.x, b.y, b.heading, b.wheel_left, b.wheel_right) for b in bodies]

    alone, two = run(1), run(2)
    assert two[0] == alone[0]
    assert two[1][3:] != two[0][3:]


def ping_echo(robot: Scripted, at: int) -> float:
    """Length of the echo pulse (us) of a ping at that cycle."""
    robot.edge(at, PING, 1)
    robot.edge(at + 5 * US, PING, 2)
    robot.run(0.03)
    rise, fall = robot.inputs(PING)[-3:-1]
    return (fall[0] - rise[0]) / US


def test_ping_hears_the_other_robot_and_not_itself() -> None:
    sim = sim_of()
    seer = add_scripted(sim, pose=(0, 0, 0))
    other = add_scripted(sim, pose=(1.0, 0, 0))
    face = 1.0 - other.robot.description.body.radius_m - 0.06
    assert ping_echo(seer, 1 * MS) == pytest.approx(2 * face / 343.5 * 1e6, abs=0.1)
    sim_alone = sim_of()
    alone = add_scripted(sim_alone, pose=(0, 0, 0))
    assert ping_echo(alone, 1 * MS) == pytest.approx(2 * 2.94 / 343.5 * 1e6, abs=0.1)


def test_infrared_sees_the_other_robot() -> None:
    for distance, seen in ((0.25, True), (1.0, False)):
        sim = sim_of()
        seer = add_scripted(sim, pose=(0, 0, 0))
        add_scripted(sim, pose=(distance, 0.08, 0))
        seer.burst(1 * MS, LED)
        seer.run(0.01)
        assert (len(seer.inputs(RECEIVER)) > 1) == seen


def test_whisker_feels_the_other_robot() -> None:
    """The tip of the left whisker is 0.1 m ahead and 0.05 m to the left."""
    for distance, level in ((0.15, 0), (0.25, 1)):
        sim = sim_of()
        feeler = add_scripted(sim, pose=(0, 0, 0))
        add_scripted(sim, pose=(distance, 0.05, 0))
        feeler.run(0.01)
        assert feeler.inputs(LEFT_WHISKER)[-1][1] == level


def test_each_robot_has_its_own_line() -> None:

    sim = sim_of()
    robots = [add_scripted(sim, pose=(0.5 * i, 0, 0)) for i in range(2)]
    scripts.script_board_byte(robots[0].script, 5 * MS, 10)
    scripts.script_board_byte(robots[1].script, 9 * MS, 20)
    robots[1].robot.listen(1)
    sim.run_until(CLOCK_HZ)  # the first one's byte does not end it
    assert 9 * MS < sim.cycle < 10 * MS
    assert [robot.robot.receive() for robot in robots] == [bytes([10]), bytes([20])]
    assert [robot.robot.last_byte_cycle for robot in robots] == [5 * MS, 9 * MS]


def test_bytes_end_a_run_of_listeners_only() -> None:

    sim = sim_of()
    robots = [add_scripted(sim, pose=(0.5 * i, 0, 0)) for i in range(2)]
    scripts.script_board_byte(robots[1].script, 5 * MS, 20)
    for robot in robots:
        robot.robot.listen(1)
    sim.run_until(CLOCK_HZ)
    assert 5 * MS < sim.cycle < 6 * MS
    sim.run(CLOCK_HZ)
    assert 1005 * MS < sim.cycle < 1006 * MS


def test_when_a_robot_is_heard_does_not_depend_on_the_cuts_of_others() -> None:
    """A byte at 5 ms is heard at the first look after two idle byte times (40 us), wherever the run is cut."""

    heard = set()
    for cut in (0, 4001, 80_333, 80_640, 81_999):
        sim = sim_of()
        robots = [add_scripted(sim, pose=(0.5 * i, 0, 0)) for i in range(2)]
        scripts.script_board_byte(robots[0].script, 5 * MS, 10)
        robots[0].robot.listen(1)
        robots[1].robot.listen(NEVER)
        if cut:
            sim.run_until(cut)
            assert sim.cycle == cut and not robots[0].robot.speaks
        sim.run_until(CLOCK_HZ)
        assert robots[0].robot.speaks and not robots[1].robot.speaks
        heard.add(sim.cycle)
    assert len(heard) == 1
    assert 5 * MS + 40 * US <= heard.pop() <= 5 * MS + 40 * US + 4000


def test_crash_names_the_board() -> None:

    sim = sim_of()
    robots = [add_scripted(sim, pose=(0.5 * i, 0, 0), number=4 * i) for i in range(2)]
    scripts.script_board_crash(robots[1].script)
    with pytest.raises(BoardError, match="of robot 5 crashed"):
        sim.run(CLOCK_HZ)


def test_places_and_numbers_are_for_one() -> None:
    sim = sim_of()
    first = add_scripted(sim, pose=(0, 0, 0), number=2)
    with pytest.raises(ArenaError, match="no free space"):
        add_scripted(sim, pose=(0.1, 0.05, 0))
    with pytest.raises(BoardError, match="taken"):
        add_scripted(sim, pose=(1, 0, 0), number=2)
    with pytest.raises(BoardError, match="expected a whole number from 0"):
        add_scripted(sim, pose=(1, 0, 0), number=-1)
    second = add_scripted(sim, pose=(1, 0, 0))
    assert second.robot.number == 3
    with pytest.raises(ArenaError, match="cannot stand at"):
        second.robot.place(0.1, 0, 0)
    second.robot.place(1.05, 0, 0)
    assert first.robot.body().x == 0


# ---- they bump each other --------------------------------------------------------------------------------


def test_robots_bump_and_neither_enters_the_other() -> None:
    sim = sim_of()
    left, right = add_scripted(sim, pose=(-0.3, 0, 0)), add_scripted(sim, pose=(0.3, 0, math.pi))
    for robot in (left, right):
        drive(robot, 4.0, 1700, 1300)
    sim.run(4 * CLOCK_HZ)
    a, b = left.robot.body(), right.robot.body()
    assert b.x - a.x == pytest.approx(0.14, abs=1e-3)  # two radii
    assert a.touching and b.touching
    assert left.robot.true_contacts == right.robot.true_contacts == 1


def test_a_driving_robot_pushes_one_that_rolls_freely() -> None:
    sim = sim_of()
    pusher, pushed = add_scripted(sim, pose=(-0.3, 0, 0)), add_scripted(sim, pose=(0.0, 0, 0))
    drive(pusher, 4.0, 1700, 1300)
    sim.run(4 * CLOCK_HZ)
    assert pushed.robot.body().x > 0.05
    assert pushed.robot.body().x - pusher.robot.body().x >= 0.14 - 1e-6


# ---- cross-talk ------------------------------------------------------------------------------------------


def lit(distance: float, heading: float, obstacle: bool = False) -> list[tuple[int, int]]:
    """The receiver of a silent robot whose left pair looks at the left pair of another robot that sends a burst."""
    arena = arena_of(*([square(distance / 2, 0, 0.05)] if obstacle else []), outline=square(0, 0, 12))
    sim = Sim(arena, noise=False)

    def pose_of(x: float, y: float, looking: float) -> tuple[float, float, float]:
        """Of a robot whose left pair is at (x, y) and looks that way."""
        from boebot.description.robots import load_robot
        from boebot.devices.infrared import InfraredPair

        pair = load_robot("shieldbot").device["infrared_left"]
        assert isinstance(pair, InfraredPair)
        turn = looking - pair.heading_rad
        px, py = pair.position_m
        return (
            x - px * math.cos(turn) + py * math.sin(turn),
            y - px * math.sin(turn) - py * math.cos(turn),
            turn,
        )

    hearer = add_scripted(sim, pose=pose_of(0, 0, 0))
    sender = add_scripted(sim, pose=pose_of(distance, 0, heading))
    sender.burst(5 * MS, LED)
    sim.run(40 * MS)
    return hearer.inputs(RECEIVER)


def test_another_robots_burst_lights_the_receiver() -> None:
    """From the eighth period of the carrier until ten after its end, a world step and a guard later."""
    late = 16_000 + 64
    (_, first), (low, dark), (high, bright) = lit(1.0, math.pi)
    assert (first, dark, bright) == (1, 0, 1)
    assert low == 5 * MS + 8 * 421 + late
    assert high == 5 * MS + 37 * 421 + 1 + 4210 + late


@pytest.mark.parametrize(
    ("distance", "heading", "obstacle"), [(2.5, math.pi, False), (1, 0, False), (1, math.pi, True)]
)
def test_what_is_far_turned_away_or_hidden_lights_nothing(distance: float, heading: float, obstacle: bool) -> None:
    assert [level for _, level in lit(distance, heading, obstacle)] == [1]


# ---- moving obstacles ------------------------------------------------------------------------------------


def moving_arena(way: list[Waypoint], count: int = 1) -> Arena:
    """A field with discs of 0.1 m on their way."""
    field = [Polygon(square(0, 0, 12), "field")]
    moving = [Moving(path=way, radius_m=0.1, repeat="once") for _ in range(count)]
    return Arena(ArenaDescription(name="test", outline=field, moving=moving))


def test_a_moving_obstacle_is_seen_where_it_is() -> None:
    """A disc of 0.1 m that comes from x = 2 m with 0.5 m/s: after 2 s its face is 0.84 m before the Ping."""
    arena = moving_arena([Waypoint(0.0, 2.0, 0.0), Waypoint(2.0, 1.0, 0.0)])
    for wait, centre in ((0.5, 1.75), (1.0, 1.5), (3.0, 1.0)):
        robot = add_scripted(Sim(arena, noise=False), pose=(0, 0, 0))
        robot.run(wait)
        echo = ping_echo(robot, robot.sim.cycle + 1)
        assert echo == pytest.approx(2 * (centre - 0.1 - 0.06) / 343.5 * 1e6, abs=6)


def test_too_many_moving_obstacles_are_refused() -> None:
    with pytest.raises(ArenaError, match="65 moving obstacles"):
        Sim(moving_arena([Waypoint(0.0, 2.0, 0.0)], count=65))
