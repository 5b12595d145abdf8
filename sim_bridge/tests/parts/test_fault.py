"""Faults of parts, wheels and the whole robot: what goes out at which cycle, how often they have fired, and that one
that does not act changes no bit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from contextlib import closing

import msgspec
import numpy as np
import pytest

from boebot.boards import BoardRequest
from boebot.description.robots import load_robot
from boebot.devices.faults import BODY_FAULTS
from boebot.errors import BoardError
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.sessions.world import AVR, open_on
from sim_bridge.sim import NEVER
from sim_bridge.tests.simulated import MS, US, Scripted, arena_of, pack_voltage, scripted, square

LEFT, RIGHT = 13, 12
ENCODER, WHISKER, LED, RECEIVER, PING = 16, 5, 9, 10, 8
ENA, IN1, IN2, IN3, IN4, ENB = 5, 7, 8, 9, 11, 6
BEGIN, END = 100 * MS + 7, 200 * MS + 3
FAST = {LEFT: 1700.0, RIGHT: 1300.0}
ROVER = load_robot("rover")


def ping(robot: Scripted, at: int) -> None:
    robot.edge(at, PING, 1)
    robot.edge(at + 5 * US, PING, 2)


def rises(robot: Scripted, pin: int) -> list[int]:
    return [cycle for (_, before), (cycle, level) in itertools.pairwise(robot.inputs(pin)) if level == 1 != before]


def laid(robot: Scripted, fault: str, value: float, begin: int, end: int) -> Callable[[], int]:
    owner, kind = fault.split(".")
    return robot.robot.fault(owner, kind, value, begin, end)


def driven(seconds: float, fault: str = "", value: float = 0.0, *, noise: bool = False) -> tuple[Scripted, int]:
    """A robot that drives straight on for that long, with a fault from BEGIN to END; how often it fired."""
    robot = scripted(noise=noise)
    robot.pulses(seconds, FAST)
    fired = laid(robot, fault, value, BEGIN, END) if fault else int
    robot.run(seconds)
    return robot, fired()


def test_a_fault_that_begins_after_the_end_changes_no_bit() -> None:
    """One of each kind of the shieldbot, with noise: all that went to the pins, and the body."""

    def run(*, faulty: bool) -> tuple[object, ...]:
        robot = scripted(arena_of(square(1.0, 0, 1)), noise=True, pose=(0.3, 0.0, 0.0))
        kinds = {name: device.FAULTS for name, device in robot.robot.description.device.items() if device.on}
        fired = [
            robot.robot.fault(owner, kind, one.default or 0.0, 2 * CLOCK_HZ, NEVER)
            for owner, all_kinds in ({**kinds, **BODY_FAULTS} if faulty else {}).items()
            for kind, one in all_kinds.items()
        ]
        assert len(fired) == (29 if faulty else 0)
        edges = [edge for at in range(10 * MS, 900 * MS, 50 * MS) for edge in ((at, PING, 1), (at + 80, PING, 2))]
        for frame in range(40):
            at = frame * 20 * MS
            edges += [(at, LEFT, 1), (at + 1700 * US, LEFT, 0), (at, RIGHT, 1), (at + 1300 * US, RIGHT, 0)]
            edges += [(at + 5 * MS + 421 * i // 2, LED, 1 - i % 2) for i in range(76)]
        for edge in sorted(edges):
            robot.edge(*edge)
        robot.run(1.0)
        assert not any(one() for one in fired)
        inputs = [[(c, level) for c, level in robot.inputs(pin) if c <= CLOCK_HZ] for pin in range(20)]
        return inputs, robot.sim.hash(), robot.robot.readings()

    assert run(faulty=True) == run(faulty=False)


def test_the_emulated_uno_meets_them_at_their_cycles() -> None:
    """In a world of the kit's firmware: its own log of what the outside does to its pins."""
    request = BoardRequest(robot=load_robot("shieldbot"), arena="room", pins=True)
    with closing(open_on(AVR, request)) as session:
        for owner, kind in (("whisker_left", "stuck"), ("infrared_left", "blinded")):
            session.fault(owner, kind, 1.0, BEGIN / CLOCK_HZ, END / CLOCK_HZ)
        session.sim.run(300 * MS)
        driven = session.board.outside_log()["driven"]
    seen = [(int(cycle), int(pin), int(level)) for cycle, pin, level in driven[["cycle", "pin", "level"]] if cycle]
    assert seen == [(BEGIN, WHISKER, 0), (BEGIN, RECEIVER, 0), (END, WHISKER, 1), (END, RECEIVER, 1)]


# ---- whisker, infrared -----------------------------------------------------------------------------------------------


def test_a_stuck_whisker_is_held_and_given_back_at_exact_cycles() -> None:
    robot = scripted()
    pressed = robot.robot.fault("whisker_left", "stuck", 1, BEGIN, END)
    opened = robot.robot.fault("whisker_left", "stuck", 0, END, NEVER)
    robot.run(0.1)
    assert (pressed(), opened()) == (0, 0)
    robot.run(0.2)
    assert robot.inputs(WHISKER) == [(0, 1), (BEGIN, 0), (END, 1)]
    assert (pressed(), opened()) == (1, 0), "open over an empty floor is what it would have been"


def test_what_a_stuck_whisker_meets_shows_when_it_is_free_again() -> None:
    """Stuck open before a wall: no edge at the touch, the true level at the end, and later bounces are as they were."""

    def run(*, faulty: bool) -> tuple[list[tuple[int, int]], int]:
        robot = scripted(arena_of(square(1, 0, 1)), pose=(0.39, 0, 0), noise=True)
        fired = robot.robot.fault("whisker_left", "stuck", 0, BEGIN, END) if faulty else int
        for seconds, x in ((0.15, 0.41), (0.15, 0.3), (0.1, 0.3)):
            robot.run(seconds)
            robot.robot.place(x, 0, 0)
        return robot.inputs(WHISKER), fired()

    edges, fired = run(faulty=True)
    assert edges[:2] == [(0, 1), (END, 0)] and fired >= 1
    clean, _ = run(faulty=False)
    after = [edge for edge in clean if edge[0] > 300 * MS]
    assert after and edges[2:] == after


def test_a_pin_that_is_given_back_and_a_plug_put_in_again_meet_the_fault() -> None:
    robot = scripted()
    robot.robot.fault("whisker_left", "stuck", 1, BEGIN, END)
    robot.pins.drive(WHISKER, 0)
    robot.run(0.05)
    robot.pins.release(WHISKER)
    robot.run(0.1)
    robot.pins.unplug("whisker_left")
    robot.run(0.01)
    robot.pins.plug("whisker_left")
    robot.run(0.1)
    out, again = 150 * MS, 160 * MS
    assert robot.inputs(WHISKER)[-5:] == [(50 * MS, 1), (BEGIN, 0), (out, 2), (again, 0), (END, 1)]


def test_a_bouncing_whisker_bounces_without_noise_too() -> None:
    robot = scripted(arena_of(square(1, 0, 1)), pose=(0.39, 0, 0))
    fired = robot.robot.fault("whisker_left", "bouncing", 0.05, 0, NEVER)
    for x in 5 * (0.41, 0.3):
        robot.robot.place(x, 0, 0)
        robot.run(0.3)
    edges = np.array(robot.inputs(WHISKER)[1:])
    touches = 1 + np.flatnonzero(np.diff(edges[:, 0]) > 250 * MS)
    bounces = [len(group) // 2 for group in np.split(edges, touches)]
    assert 5 <= fired() == sum(count > 0 for count in bounces) and max(bounces) <= 4
    assert max(group[-1, 0] - group[0, 0] for group in np.split(edges, touches)) > 20 * MS


def test_a_blinded_receiver_is_low_and_sees_its_own_burst_again() -> None:
    robot = scripted(arena_of(square(0.65, 0, 1)))  # a wall 0.1 m ahead of the sensor
    fired = robot.robot.fault("infrared_left", "blinded", 0, BEGIN, END)
    for start in (50 * MS, 150 * MS, END - 2 * MS, 300 * MS):
        robot.burst(start, LED, cycles=152)  # 4 ms
    robot.run(0.4)
    edges = robot.inputs(RECEIVER)
    lows = [(a, b) for (a, level), (b, _) in itertools.pairwise(edges) if level == 0]
    assert len(lows) == 3 and lows[1][0] == BEGIN
    hold = [end - start for (_, end), start in zip(lows, (50 * MS, END - 2 * MS, 300 * MS), strict=True)]
    assert hold[0] == hold[1] == hold[2], "a burst under way as it ends is seen to its own end"
    assert fired() >= 1


# ---- range finders ---------------------------------------------------------------------------------------------------


def pinged(fault: str, value: float = 0.0) -> tuple[list[tuple[int, int]], int]:
    """The answers to triggers that end before, at the first and the last cycle of a fault, and at its end."""
    robot = scripted()
    fired = robot.robot.fault("ping", fault, value, BEGIN, END)
    for end in (BEGIN - 1, BEGIN + 50 * MS, END + 50 * MS):
        ping(robot, end - 5 * US)
    robot.run(0.35)
    return robot.inputs(PING), fired()


def test_missing_late_and_doubled_echoes() -> None:
    wait, nothing, rest = 750 * US, 18_500 * US, 100 * US
    triggers = BEGIN - 1, BEGIN + 50 * MS, END + 50 * MS

    def answers(*pulses: int) -> list[tuple[int, int]]:
        return [e for at in pulses for e in ((at, 1), (at + nothing, 0), (at + nothing + rest, 2))]

    first, second, third = (at + wait for at in triggers)
    assert pinged("missing") == (answers(first, third), 1)
    assert pinged("late", 0.01) == (answers(first, second + 10 * MS, third), 1)
    again = second + nothing + 2 * MS
    doubled = [*answers(first), (second, 1), (second + nothing, 0), *answers(again), *answers(third)]
    assert pinged("doubled", 0.002) == (doubled, 1)


def test_an_hc_sr04_fails_alike() -> None:
    robot = scripted(robot=ROVER)
    sonar = ROVER.device["sonar"]
    trigger, echo = sonar.pins().values()
    fired = robot.robot.fault("sonar", "doubled", 0.001, 0, NEVER)
    robot.edge(MS, trigger, 1)
    robot.edge(MS + 10 * US, trigger, 0)
    robot.run(0.2)
    first, second = rises(robot, echo)
    assert second - first == 38 * MS + MS and fired() == 1


# ---- encoders --------------------------------------------------------------------------------------------------------


def test_missing_edges_leave_the_others_and_the_other_wheel() -> None:
    clean, _ = driven(0.4)
    gone, fired = driven(0.4, "encoder_left.missing", 1.0)
    wanted = clean.inputs(ENCODER)
    inside = [cycle for cycle, _ in wanted if BEGIN <= cycle < END]
    assert fired >= 3 and gone.inputs(ENCODER + 1) == clean.inputs(ENCODER + 1)
    left = [cycle for cycle, _ in gone.inputs(ENCODER)]
    assert not [cycle for cycle in left if BEGIN <= cycle < END]
    before = [cycle for cycle, _ in wanted if cycle < BEGIN]
    assert left[: len(before)] == before and fired == (len(inside) + 1) // 2, "a missed one takes the next with it"


def test_shares_are_drawn_by_the_cycle() -> None:
    """About that share of the edges, the same for the same seed, with the noise switched off."""
    robots = [scripted(seed=seed) for seed in (1, 1, 2)]
    counts = []
    for robot in robots:
        robot.pulses(4.0, FAST)
        fired = robot.robot.fault("encoder_left", "extra", 0.25, 0, NEVER)
        robot.run(4.0)
        counts.append(fired())
    edges = len(robots[0].inputs(ENCODER)) - 2 * counts[0]
    assert robots[0].inputs(ENCODER) == robots[1].inputs(ENCODER) != robots[2].inputs(ENCODER)
    assert abs(counts[0] - 0.25 * edges) < 4 * math.sqrt(0.25 * 0.75 * edges)


def test_a_noisy_encoder_is_a_square_wave_and_then_itself() -> None:
    clean, _ = driven(0.4)
    noisy, fired = driven(0.4, "encoder_left.noisy", 10_000.0)
    edges = noisy.inputs(ENCODER)
    before = [edge for edge in clean.inputs(ENCODER) if edge[0] < BEGIN]
    after = [edge for edge in clean.inputs(ENCODER) if edge[0] >= END]
    wave = [cycle for cycle, _ in edges if BEGIN < cycle < END]
    assert edges[: len(before)] == before and edges[-len(after) :] == after
    assert set(np.diff(wave)) == {800} and wave[0] - BEGIN in (800, 1600) and wave[-1] > END - 800
    assert fired >= len(wave)


# ---- motors, wheels, body --------------------------------------------------------------------------------------------


def speeds(fault: str, value: float = 0.0, seconds: float = 1.0, robot: Scripted | None = None) -> tuple[float, ...]:
    """Speed and turn rate of a robot that drives straight on with a fault from the start; rims, how often it fired."""
    if robot is None:
        robot = scripted()
        robot.pulses(seconds, FAST)
    fired = laid(robot, fault, value, 0, NEVER) if fault else int
    robot.run(seconds)
    body = robot.robot.body()
    return body.speed, body.turn_rate, body.rim_left, body.rim_right, fired()


HALF = load_robot("shieldbot").body.track_width_m / 2


def test_servos_dead_reversed_offset_and_weak() -> None:
    full, _, rim, _, _ = speeds("")
    _, _, left, right, fired = speeds("servo_left.dead")
    assert abs(left) < 0.7 * rim and right > 0.9 * rim and fired == 50
    speed, turn_rate, left, right, fired = speeds("servo_left.reversed")
    assert left == pytest.approx(-right) and abs(speed) < 1e-3 and turn_rate > 1 and fired == 50
    _, _, left, right, fired = speeds("servo_left.offset", -200.0)
    assert abs(left) < 0.1 * right and fired == 50, "1,500 us: it stands"
    speed, _, _, _, fired = speeds("servo_left.weak", 0.0)
    assert speed < full and fired > 900


def test_a_weak_servo_has_that_share_of_its_torque() -> None:
    """From rest both wheels alike: the acceleration of the first steps is that share."""

    def pushed(value: float) -> float:
        robot = scripted(without=("tyre_slip",))
        robot.pulses(0.1, FAST)
        for side in ("left", "right"):
            robot.robot.fault(f"servo_{side}", "weak", value, 0, NEVER)
        robot.run(0.003)
        return float(robot.robot.body().speed)

    assert 0 < pushed(0.25) == pytest.approx(0.25 * pushed(1.0), rel=0.05)


@pytest.mark.parametrize(("fault", "ratio"), [("dead", 0.0), ("reversed", -1.0), ("weak", 0.5)])
def test_motors_at_an_h_bridge_fail_alike(fault: str, ratio: float) -> None:
    """A rover held by its grip alone: the torque of both motors, so its way in the first 20 ms."""

    def way(laid: bool) -> tuple[float, int]:
        robot = scripted(robot=ROVER)
        for pin in (ENA, IN1, ENB, IN4):
            robot.edge(0, pin, 1)
        fired: list[Callable[[], int]] = []
        if laid:
            fired = [robot.robot.fault(f"motor_{side}", fault, 0.5, 0, NEVER) for side in ("left", "right")]
        robot.run(0.02)
        return float(robot.robot.body().speed), sum(one() for one in fired)

    (clean, _), (faulty, fired) = way(False), way(True)
    assert clean > 0.01 and faulty == pytest.approx(ratio * clean, rel=0.15, abs=1e-9) and fired > 20


def test_a_blocked_wheel_is_what_the_robot_turns_about() -> None:
    """The other one drives on: v = V / 2, omega = V / 2R, and the blocked wheel stays where it is."""
    robot = scripted()
    robot.pulses(1.0, FAST)
    speed, turn_rate, left, right, fired = speeds("wheel_left.blocked", robot=robot)
    body = robot.robot.body()
    stays = body.x - HALF * body.sine, body.y + HALF * body.cosine
    assert stays == pytest.approx((0.0, HALF), abs=1e-4) and body.heading > 0.5
    assert left == 0.0 and right > 0.1 and fired > 900
    assert speed == pytest.approx(right / 2, rel=1e-5) and turn_rate == pytest.approx(right / (2 * HALF), rel=1e-5)


def test_a_wheel_turns_again_when_it_is_no_longer_blocked() -> None:
    robot, fired = driven(2.0, "wheel_left.blocked")
    body = robot.robot.body()
    assert 90 < fired <= 101 and not body.slipping and body.rim_left == pytest.approx(body.rim_right, rel=1e-3)
    stood = [edge for edge in robot.inputs(ENCODER) if BEGIN + 2 * MS < edge[0] < END]
    assert not stood and len([c for c, _ in robot.inputs(ENCODER + 1) if BEGIN < c < END]) >= 5


def test_a_slipping_wheel_spins_and_its_encoder_says_nothing() -> None:
    clean, _, rim, _, _ = speeds("")
    speed, turn_rate, left, _, fired = speeds("wheel_left.slipping", 0.005)
    assert speed < 0.97 * clean and turn_rate > 0.1 and left > 0.9 * rim and fired > 500
    assert speeds("wheel_left.slipping", 2.0) == pytest.approx(speeds(""), abs=1e-6), "more grip than there is"


def test_a_lifted_robot_stays_while_its_wheels_turn_and_drives_on() -> None:
    robot, fired = driven(1.0, "robot.lifted")
    truth = robot.robot.truth()
    held = (truth["time"] > 0.101) & (truth["time"] < 0.2)
    assert np.ptp(truth["x"][held]) == 0 and set(truth["speed"][held]) == {0.0}
    assert len([c for c, _ in robot.inputs(ENCODER) if BEGIN < c < END]) >= 5
    clean = driven(1.0)[0].robot.body()
    assert 190 < fired <= 202 and truth["speed"][-1] == pytest.approx(clean.speed, rel=1e-3)


# ---- line, battery ---------------------------------------------------------------------------------------------------


def test_a_dirty_line_sensor_decays_the_slower() -> None:
    """Half of the light: twice the time."""

    def decay(value: float) -> tuple[float, int]:
        robot = scripted(robot=load_robot("shieldbot-line"))
        (pin,) = robot.robot.description.device["line_left"].pins().values()
        fired = robot.robot.fault("line_left", "dirty", value, 0, NEVER)
        robot.edge(MS, pin, 1)
        robot.edge(2 * MS, pin, 2)
        robot.run(0.1)
        return robot.inputs(pin)[-1][0] - 2 * MS, fired()

    (clean, _), (dirty, fired) = decay(0.0), decay(0.5)
    assert dirty == pytest.approx(2 * clean, abs=2) and fired == 1


def test_a_dirty_line_module_is_nearer_to_dark() -> None:
    robots = [scripted(robot=ROVER), scripted(robot=ROVER)]
    fired = robots[1].robot.fault("line_left", "dirty", 0.5, 0, NEVER)
    volts = []
    for robot in robots:
        robot.run(0.01)
        volts.append(robot.robot.readings()[robot.robot.layout["line_left"].start])
    assert 5.0 - volts[1] == pytest.approx(0.5 * (5.0 - volts[0])) and fired() == 10


def test_a_sagging_battery_takes_the_rails_with_it() -> None:
    robot = scripted()
    fired = robot.robot.fault("battery", "sagging", 4.6, BEGIN, END)
    seen = []
    for _ in range(3):
        robot.run(0.1)
        seen.append((pack_voltage(robot.robot), robot.robot.supply_voltage))
    assert seen[0] == pytest.approx(seen[2]) and seen[0][1] == 5.0
    assert seen[1] == pytest.approx((4.6, 4.1)) and fired() == 100
    strong = scripted()
    fired = strong.robot.fault("battery", "sagging", 30.0, 0, NEVER)
    strong.run(0.1)
    assert fired() == 0


# ---- bad input -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("owner", "kind", "value", "begin", "end", "said"),
    [
        ("ping", "stuck", 0, 0, 10, "fault ping.stuck: robot 'shieldbot' has no such fault"),
        ("laser", "dead", 0, 0, 10, "fault laser.dead: robot 'shieldbot' has no such fault"),
        ("buzzer", "dead", 0, 0, 10, "fault buzzer.dead: robot 'shieldbot' has no such fault"),
        ("encoder_left", "missing", 1.1, 0, 10, "fault encoder_left.missing: its value is 1.1; expected"),
        ("encoder_left", "noisy", math.nan, 0, 10, "fault encoder_left.noisy: its value is nan; expected"),
        ("whisker_left", "stuck", 2, 0, 10, "fault whisker_left.stuck: its value is 2; expected"),
        ("ping", "late", 0.01, 10, 10, "fault ping.late: its end is 10; expected"),
        ("ping", "late", 0.01, -1, 10, "fault ping.late: its begin is -1; expected"),
        ("ping", "late", 0.01, 50, 60, "fault ping.late: another one acts at the same time"),
    ],
)
def test_faults_that_are_none(owner: str, kind: str, value: float, begin: int, end: int, said: str) -> None:
    robot = scripted()
    robot.robot.fault("ping", "late", 0.01, 40, 55)
    with pytest.raises(BoardError) as raised:
        robot.robot.fault(owner, kind, value, begin, end)
    assert str(raised.value).startswith(said)
    robot.robot.fault("ping", "late", 0.01, 55, 60)


def test_no_sagging_without_a_pack() -> None:
    robot = scripted(robot=msgspec.structs.replace(load_robot("shieldbot"), supply=None))
    with pytest.raises(BoardError, match=r"fault battery.sagging: robot 'shieldbot' has no such fault"):
        robot.robot.fault("battery", "sagging", 4.6, 0, NEVER)
